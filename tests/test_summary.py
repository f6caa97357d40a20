"""Figures of quantities, summary.csv, result.json."""

import csv
import json

import numpy as np
import pytest
from scipy import stats

from rigid.inference import convergence
from rigid.inference.posterior import stack
from rigid.inference.summary import (
    Check,
    Cost,
    Gap,
    ParameterRow,
    Result,
    Summary,
    summarise,
    write_result_json,
    write_summary_csv,
)

ENSEMBLE = np.repeat(np.arange(4), 10)


def rows():
    known = Summary(6.1e7, 1e5, 6.09e7, 5.9e7, 6.3e7, 2_345.6, 1_800.0, 1.003)
    fixed = Summary(1.0, 0.0, 1.0, 1.0, float("nan"), None, None, None)
    return [
        ParameterRow("k_LC", "N/m", known, 6e7),
        ParameterRow("kappa[free-run-2,A]", "1", fixed),
    ]


def result(**change):
    settings = {
        "spec": "calibration.toml",
        "simulated": True,
        "checks": [Check("r_hat", True, "R-hat is below 1.01"), Check("gap", True, "µ")],
        "parameters": rows(),
        "gap": Gap(1.02, {"frame-1": {"load": 1.0, "stroke": float("inf")}}),
        "cost": Cost(20.0, 5.0, 40_000, 500.0, 3),
        "seed": 1,
        "versions": {"rigid": "0.1.0"},
        "sha256": {"frame-1": "ab"},
    }
    return Result(**{**settings, **change})


def test_figures_are_those_of_the_law():
    values = np.random.default_rng(1).gamma(3.0, size=(40, 500))
    found = summarise(values, ENSEMBLE)
    law = stats.gamma(3.0)
    n = values.size
    assert abs(found.mean - 3.0) < 4 * np.sqrt(3.0 / n)
    assert abs(found.sd - np.sqrt(3.0)) < 4 * np.sqrt(3.0) * np.sqrt((law.stats("k") + 2) / 4 / n)
    for value, p in ((found.q05, 0.05), (found.median, 0.5), (found.q95, 0.95)):
        truth = law.ppf(p)
        assert abs(value - truth) < 4 * np.sqrt(p * (1 - p) / n) / law.pdf(truth)
    assert abs(found.ess_bulk / n - 1.0) < 0.15
    assert abs(found.ess_tail / n - 1.0) < 0.15
    assert found.r_hat < 1.01


def test_figures_agree_with_those_of_the_stopping_rule():
    values = np.random.default_rng(2).normal(size=(4, 100, 10))
    values[1] += 0.2
    found = summarise(stack(values), ENSEMBLE)
    assert found.r_hat == convergence.r_hat(values)
    assert (found.ess_bulk, found.ess_tail) == convergence.effective_sizes(values)
    mixed = np.random.default_rng(0).permutation(40)  # chains in any order, by their label
    again = summarise(stack(values)[mixed], ENSEMBLE[mixed])
    assert again.r_hat == pytest.approx(found.r_hat, abs=1e-12)


def test_r_hat_is_between_ensembles_and_within_modes():
    values = np.random.default_rng(3).normal(size=(40, 200))
    assert summarise(values + 1.0 * (ENSEMBLE == 0)[:, None], ENSEMBLE).r_hat > 1.05
    modes = (np.random.default_rng(4).random(values.shape) < 0.1).astype(int)
    apart = values + 30.0 * modes + 0.8 * modes * (ENSEMBLE == 0)[:, None]
    assert summarise(apart, ENSEMBLE).r_hat < 1.01
    assert summarise(apart, ENSEMBLE, modes).r_hat > 1.02


def test_a_constant_has_no_convergence():
    found = summarise(np.full((40, 50), 2.0), ENSEMBLE)
    assert (found.mean, found.sd, found.q05) == (2.0, 0.0, 2.0)
    assert found.ess_bulk is None
    assert found.ess_tail is None
    assert found.r_hat is None


def test_ensembles_of_different_size_are_refused():
    with pytest.raises(ValueError, match="number of walkers"):
        summarise(np.zeros((3, 5)), np.array([0, 0, 1]))


def test_the_table_has_the_columns_of_the_contract(tmp_path):
    write_summary_csv(tmp_path / "summary.csv", rows())
    text = (tmp_path / "summary.csv").read_text()
    head = "name,unit,mean,sd,median,q05,q95,ess_bulk,ess_tail,r_hat,published"
    assert text.splitlines()[0] == head
    first, second = csv.DictReader(text.splitlines())
    assert first["name"] == "k_LC"
    assert float(first["published"]) == 6e7
    assert second["name"] == "kappa[free-run-2,A]"
    assert (second["q95"], second["r_hat"], second["published"]) == ("", "", "")
    assert "nan" not in text.lower()


def test_the_result_has_the_keys_of_the_contract(tmp_path):
    write_result_json(tmp_path / "result.json", result())
    text = (tmp_path / "result.json").read_text()
    assert "NaN" not in text
    assert "Infinity" not in text
    found = json.loads(text)
    assert list(found) == [
        "schema", "spec", "usable", "simulated", "checks", "parameters", "gap", "cost", "solver",
        "seed", "versions", "sha256",
    ]  # fmt: skip
    assert found["schema"] == 1
    assert found["usable"] is True
    assert found["checks"][0] == {"name": "r_hat", "ok": True, "says": "R-hat is below 1.01"}
    assert set(found["parameters"]["k_LC"]) == {
        "unit", "median", "mean", "sd", "q05", "q95", "ess_bulk", "ess_tail", "r_hat", "published",
    }  # fmt: skip
    assert found["parameters"]["kappa[free-run-2,A]"]["q95"] is None
    assert found["gap"] == {"overall": 1.02, "records": {"frame-1": {"load": 1.0, "stroke": None}}}
    assert found["cost"] == {
        "wall_s": 20.0, "compile_s": 5.0, "evaluations": 40_000, "evaluations_per_s": 2_000.0,
        "ess_min": 500.0, "ess_min_per_s": 25.0, "failed_solves": 3,
    }  # fmt: skip


def test_a_failed_check_makes_the_result_unusable():
    assert not result(checks=[Check("r_hat", False, "R-hat of mu is 1.2")]).values()["usable"]
    cost = Cost(0.0, 0.0, 0, None, 0).values()
    assert cost["ess_min"] is None
    assert cost["ess_min_per_s"] is None
    assert cost["evaluations_per_s"] is None


def test_numbers_of_numpy_are_written_as_numbers(tmp_path):
    odd = result(gap=Gap(np.float64(1.5), {"a": {"load": np.float64(np.nan)}}))
    write_result_json(tmp_path / "result.json", odd)
    found = json.loads((tmp_path / "result.json").read_text())
    assert found["gap"] == {"overall": 1.5, "records": {"a": {"load": None}}}
