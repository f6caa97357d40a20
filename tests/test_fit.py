"""One fit from end to end: a spec of one's own in, every file of the contract out."""

import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import arviz as az
import numpy as np
import pytest
from small_campaign import make, write_spec

import rigid
from rigid.inference.posterior import load_posterior

pytestmark = pytest.mark.slow  # a whole fit in a process of its own; CI runs it beside the verdicts

ROOT = Path(rigid.__file__).parents[1]
GROUPS = {
    "posterior",
    "prior",
    "prior_predictive",
    "posterior_predictive",
    "log_likelihood",
    "observed_data",
    "constant_data",
    "sample_stats",
}
FIGURES = {"unit", "median", "mean", "sd", "q05", "q95", "ess_bulk", "ess_tail", "r_hat"}
RUNS = {"squeeze,left", "stroll,left", "stroll,right", "snap,left"}
# Names in the spec of one's own -> names in the truth of the generator.
TRUTH = {
    "k_LC": "k_LC",
    "mu": "mu",
    "mu_branch[1]": "mu_branch[1]",
    "mu_branch[2]": "mu_branch[2]",
    "tau_branch[1]": "tau_branch[1]",
    "tau_branch[2]": "tau_branch[2]",
    "kappa[squeeze,left]": "kappa[frame-1,A]",
    "kappa_tank[squeeze,left]": "kappa_tank[frame-1,A]",
    "kappa[stroll,left]": "kappa[free-run-2,A]",
    "kappa[stroll,right]": "kappa[free-run-2,B]",
    "preload[snap,left]": "preload[release-1,A]",
    "release_time[snap,left]": "release_time[release-1,A]",
}


def fit(folder, *arguments):
    """Run the command as users do."""
    return subprocess.run(
        [sys.executable, "-m", "rigid.fit", str(folder / "specs" / "own.toml"), *arguments],
        capture_output=True,
        text=True,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        timeout=900,
    )


class Fitted:
    """A campaign and what came of its first fit."""

    def __init__(self, folder: Path):
        self.folder, self.out = folder, folder / "out"
        self.truth = make(folder)
        self.done = fit(folder, "--out", "out")
        assert self.done.returncode in (0, 1), self.done.stderr
        self.result = json.loads(
            (self.out / "result.json").read_text("utf-8"), parse_constant=pytest.fail
        )
        self.posterior = load_posterior(self.out / "posterior.nc")

    def draws(self, group="posterior"):
        return self.posterior[group].to_dataset()


@pytest.fixture(scope="session")
def fitted(tmp_path_factory) -> Fitted:
    return Fitted(tmp_path_factory.mktemp("campaign"))


def test_it_ends_well(fitted):
    failed = [c for c in fitted.result["checks"] if not c["ok"]]
    assert fitted.done.returncode == 0, failed
    assert fitted.result["usable"] is True
    assert all(c["ok"] and c["says"] for c in fitted.result["checks"])


def test_the_first_answer_is_told_early_and_agrees_with_the_last(fitted):
    """A Gaussian around the best fit: within half a posterior sd here, and marked as what it is."""
    told = fitted.done.stderr.split("first answer after")[1]
    assert "preliminary" in told.splitlines()[0]
    assert "sample by weights: " in told  # the draws came afterwards
    for name in ("k_LC", "mu", "kappa[stroll,left]"):
        row = next(line.split() for line in told.splitlines() if line.split()[:1] == [name])
        last = fitted.result["parameters"][name]
        assert abs(float(row[1]) - last["median"]) < 0.5 * last["sd"], name
    assert "preliminary" not in fitted.result


def test_the_files_are_those_of_the_contract(fitted):
    names = {p.name for p in fitted.out.iterdir()}
    assert {"index.html", "posterior.nc", "summary.csv", "result.json"} <= names
    assert not [n for n in names if n.endswith(".part")]


def test_standard_output_is_the_table_alone(fitted):
    lines = fitted.done.stdout.splitlines()
    assert lines[0].split()[:2] == ["parameter", "unit"]
    assert [line.split("  ")[0].rstrip() for line in lines[1:-1]] == list(
        fitted.result["parameters"]
    )
    assert lines[-1].startswith("simulated data; gap ")
    assert fitted.done.stderr.splitlines()[0].startswith("rigid ")


def test_standard_deviations_are_those_of_the_intervals(fitted):
    """A walker that is still under way would widen the first alone, which ranks do not see."""
    for name, row in fitted.result["parameters"].items():
        assert row["sd"] < 1.3 * (row["q95"] - row["q05"]) / 3.29, name


def test_result_json_has_the_keys_of_the_contract(fitted):
    result = fitted.result
    assert set(result) == {
        *("schema", "spec", "usable", "simulated", "checks", "parameters"),
        *("gap", "cost", "solver", "seed", "versions", "sha256"),
        *("held_exact", "set_aside", "why_solver"),
    }
    assert (result["schema"], result["spec"], result["simulated"]) == (1, "own", True)
    assert result["set_aside"] == []
    assert "S_Pl" in [one["name"] for one in result["held_exact"]]
    assert any(check["name"] == "optimum" and check["ok"] for check in result["checks"])
    assert result["seed"] == 3
    for figures in result["parameters"].values():
        assert set(figures) >= FIGURES
    assert result["parameters"]["k_LC"]["unit"] == "N/m"
    assert result["parameters"]["k_LC"]["published"] == 6e7
    assert set(result["cost"]) == {
        *("wall_s", "compile_s", "evaluations", "evaluations_per_s"),
        *("ess_min", "ess_min_per_s", "failed_solves"),
    }
    assert {"rigid", "jax", "emcee", "arviz"} <= set(result["versions"])
    assert set(result["sha256"]) == RUNS
    assert all(re.fullmatch("[0-9a-f]{64}", h) for h in result["sha256"].values())
    records = result["gap"]["records"]
    assert set(records) == {"squeeze", "stroll,left", "stroll,right", "snap"}
    assert set(records["squeeze"]) == {"load", "stroke", "pressure"}
    assert set(records["snap"]) == {"acceleration"}
    assert 0.9 < result["gap"]["overall"] < 1.1  # noise levels are drawn 15 % about the sheet's


def test_summary_csv_says_the_same(fitted):
    with open(fitted.out / "summary.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [r["name"] for r in rows] == list(fitted.result["parameters"])
    for row in rows:
        told = fitted.result["parameters"][row["name"]]
        for column in ("mean", "sd", "median", "q05", "q95"):
            assert math.isclose(float(row[column]), told[column], rel_tol=1e-12)


def test_posterior_opens_in_arviz_with_its_groups(fitted):
    opened = az.from_netcdf(fitted.out / "posterior.nc")
    groups = opened.groups() if callable(opened.groups) else opened.groups
    assert {g.strip("/") for g in groups} - {""} == GROUPS
    posterior = opened["posterior"]
    assert set(posterior["k_LC"].dims) == {"chain", "draw"}


@pytest.mark.parametrize("group", ["posterior", "prior"])
def test_names_dimensions_and_units(fitted, group):
    draws = fitted.draws(group)
    units = {name: draws[name].attrs.get("units") for name in draws.data_vars}
    assert units["k_LC"] == "N/m"
    assert units["mu"] == units["mu_omega"] == "N s/m"
    assert units["k_omega"] == "N/m"
    assert units["kappa"] == "1"
    assert all(units.values())
    assert draws["mu_omega"].dims[-1] == "frequency"
    assert draws["frequency"].attrs["units"] == "Hz"
    assert draws["kappa"].dims == ("chain", "draw", "record", "cylinder")
    assert np.isfinite(draws["kappa"].sel(record="stroll", cylinder="right")).all()
    assert np.isnan(draws["kappa"].sel(record="squeeze", cylinder="right")).all()
    assert draws["mu_branch"].dims == ("chain", "draw", "branch")


def test_chain_is_a_walker_of_an_ensemble(fitted):
    draws = fitted.draws()
    assert set(np.unique(draws["ensemble"])) == {0, 1}
    assert draws.sizes["chain"] == 2 * len(np.unique(draws["walker"]))


def test_friction_parts_agree_with_the_parameters(fitted):
    draws = fitted.draws()
    omega = 2 * np.pi * draws["frequency"]
    mu = draws["mu"] + (draws["mu_branch"] / (1 + 1j * omega * _tau(draws))).sum("branch")
    np.testing.assert_allclose(draws["mu_omega"].values, _like(mu.real, draws), rtol=1e-9)
    np.testing.assert_allclose(draws["k_omega"].values, _like(-omega * mu.imag, draws), rtol=1e-9)


def _tau(draws):
    return draws["tau_branch"]


def _like(values, draws):
    return values.transpose(*draws["mu_omega"].dims).values


def test_log_likelihood_has_a_value_per_record(fitted):
    group = fitted.draws("log_likelihood")
    name = "record_log_likelihood"
    assert group[name].dims == ("chain", "draw", "record")
    assert set(group["record"].values) == {"squeeze", "stroll", "snap"}
    assert np.isfinite(group[name]).all()


def test_log_likelihood_has_a_value_per_block_too(fitted):
    group = fitted.draws("log_likelihood")
    blocks = group["block_log_likelihood"]
    assert blocks.dims == ("chain", "draw", "block")
    assert set(group["block_channel"].values) == RUNS
    assert np.isfinite(blocks).all()


def test_predictions_stand_beside_what_was_read(fitted):
    seen = fitted.draws("observed_data")
    for group in ("posterior_predictive", "prior_predictive"):
        assert set(fitted.draws(group).data_vars) == set(seen.data_vars)
    load = seen["load[squeeze,left]"]
    path = fitted.folder / "measured" / "day 1" / "squeeze.txt"
    cells = [line.split(";")[1] for line in path.read_text("utf-8").splitlines()[2:]]
    recorded = np.array([float(c.replace(",", ".")) for c in cells])
    np.testing.assert_allclose(load.values, recorded)
    assert load.attrs["units"] == "N"


@pytest.mark.parametrize("name", TRUTH)
def test_the_truth_lies_in_the_posterior(fitted, name):
    figures = fitted.result["parameters"][name]
    truth = fitted.truth["parameters"][TRUTH[name]]
    # 4 sd: of twelve parameters of a right fit, one is further off once in 1,300 campaigns.
    assert abs(truth - figures["median"]) < 4 * figures["sd"]


def test_the_page_needs_no_network_and_says_simulated(fitted):
    page = (fitted.out / "index.html").read_text("utf-8")
    assert "<h4><code>abs_mu[80 Hz]</code>" in page  # its uncertainty budget
    assert "simulated" in page.lower()
    assert "A rig of one" in page
    fetched = re.findall(r"""(?:src|href|xlink:href)\s*=\s*["']([^"'#][^"']*)""", page)
    beside = {f for f in fetched if not f.startswith("data:")}
    # Files of figures and text lie beside the page; they are there to be opened, none is fetched.
    assert beside == set(re.findall(r'<a href="((?:figures/)?[\w-]+\.\w+)"', page))
    assert all((fitted.out / name).is_file() for name in beside)
    assert not re.findall(r"url\(\s*['\"]?(?:https?:)?//", page)
    assert "@import" not in page


def test_text_for_a_paper_counts_the_readings_that_are_compared(fitted):
    """As many as residuals; a release is cut before its onset, and its grid filled up behind."""
    seen = fitted.draws("observed_data")
    compared = sum(int(np.isfinite(one).sum()) for one in seen.data_vars.values())
    assert f"; {compared} samples in all)" in (fitted.out / "for-paper.txt").read_text("utf-8")


@pytest.mark.long
def test_a_finished_run_is_gone_on_with_unchanged(fitted, tmp_path):
    copy = tmp_path / "out"
    shutil.copytree(fitted.out, copy)
    done = fit(fitted.folder, "--out", str(copy), "--resume", "--quiet", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert json.loads(done.stdout) == json.loads((copy / "result.json").read_text("utf-8"))
    again = load_posterior(copy / "posterior.nc")
    for group in ("posterior", "log_likelihood", "sample_stats"):
        assert fitted.draws(group).identical(again[group].to_dataset()), group


@pytest.mark.long
def test_a_tighter_rule_goes_on_from_the_chain(fitted):
    old = (fitted.folder / "specs" / "own.toml").read_text("utf-8")
    spent = fitted.result["cost"]["evaluations"]
    copy = fitted.folder / "tighter"
    shutil.copytree(fitted.out, copy)
    try:
        write_spec(fitted.folder, fitted.truth, ess=1.5 * least(fitted), r_hat=1.05)
        done = fit(fitted.folder, "--out", str(copy), "--resume", "--quiet")
    finally:
        (fitted.folder / "specs" / "own.toml").write_text(old, "utf-8")
    assert done.returncode == 0, done.stderr
    result = json.loads((copy / "result.json").read_text("utf-8"))
    assert result["cost"]["evaluations"] > spent
    assert result["cost"]["ess_min"] > fitted.result["cost"]["ess_min"]


def least(fitted):
    return fitted.result["cost"]["ess_min"]
