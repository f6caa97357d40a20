"""`python -m rigid.compare`: what moved, by how much, and what differs; with small fake runs."""

import csv
import json
import math
import re
from pathlib import Path

import fake_calibration as fake
import numpy as np
import pytest
import xarray as xr

from rigid import compare as command
from rigid.inference.posterior import chain_coords, save_posterior
from rigid.io.errors import InputError
from rigid.report.compare.content import _signed, compared
from rigid.report.compare.differences import differences
from rigid.report.compare.moved import LEAST_SHARE, SDS_IN_90, moves, same_model, sharing
from rigid.report.compare.runs import Figures, Run, read_run, read_runs
from rigid.study.compare import compare

SPEC = """
title = "A rig"
simulated = true
[model]
effects = ["load-cell-spring", "viscous-friction"{more}]
[priors]
k_LC = {{ lognormal = {{ median = 6e7, factor = {factor} }} }}
[[records]]
name = "frame-1"
kind = "frame"
cylinder = "A"
file = "{file}"
[sampler]
seed = {seed}
"""


def draws(seed, k_lc):
    """Fake draws with friction over frequency, as a fit writes them."""
    rng = np.random.default_rng(seed)
    frequency = xr.Variable("frequency", np.geomspace(0.01, 1000.0, 5), {"units": "Hz"})
    shape = (8, 50)
    friction = 1e5 * np.exp(0.1 * rng.standard_normal((*shape, 1))) * np.ones(5)
    k = k_lc + 1.2e6 * rng.standard_normal(shape)
    return xr.Dataset(
        {
            "k_LC": (("chain", "draw"), k, {"units": "N/m"}),
            "zero": (
                ("chain", "draw", "quantity", "cylinder"),
                0.0 * k[..., None, None] + 3.0,
                {"units": "m/s^2"},
            ),
            "mu_omega": (("chain", "draw", "frequency"), friction, {"units": "N s/m"}),
            "k_omega": (("chain", "draw", "frequency"), 0 * friction, {"units": "N/m"}),
        },
        coords={
            **chain_coords(2, 4, 50),
            "frequency": frequency,
            "quantity": ["load"],
            "cylinder": ["A"],
        },
    )


def make(folder, k_lc=6e7, usable=True, more="", factor=2.0, digest="a" * 64, seed=1, gap=1.0):
    """A folder such as `rigid.fit` writes, of fake numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    digests = {"frame-1,A": digest, "release-1,A": "c" * 64 if digest[0] == "a" else "d" * 64}
    parameters = {
        p.name: {"unit": p.unit, "median": p.median, "sd": p.sd, "q05": p.q05, "q95": p.q95}
        for p in fake.parameters()
    }
    parameters["k_LC"] = {
        "unit": "N/m", "median": k_lc, "sd": 1.2e6, "q05": k_lc - 2e6, "q95": k_lc + 2e6
    }  # fmt: skip
    result = {
        "schema": 1, "spec": "rig", "usable": usable, "simulated": True,
        "checks": [{"name": "converged", "ok": usable, "says": "after 100 steps"}],
        "parameters": parameters,
        "gap": {"overall": gap, "records": {"frame-1": {"load": gap, "stroke": 1.01}}},
        "seed": seed, "versions": {"rigid": "0.1.0"}, "sha256": digests,
    }  # fmt: skip
    (folder / "result.json").write_text(json.dumps(result), "utf-8")
    effects = "load-cell-spring,viscous-friction" + (",coulomb-friction" if more else "")
    spec = SPEC.format(more=more, factor=factor, file="frame.csv", seed=seed)
    attrs = {
        "spec": spec, "spec_name": "rig", "simulated": 1, "effects": effects, "seed": seed,
        "versions": json.dumps({"rigid": "0.1.0"}), "sha256": json.dumps(digests),
    }  # fmt: skip
    save_posterior(folder / "posterior.nc", {"posterior": draws(seed, k_lc)}, attrs)
    return folder


def run_of(sd=1.0, median=100.0, records=("a",), spec="x = 1", name="run"):
    figures = Figures("N/m", median, sd, median - 1.645 * sd, median + 1.645 * sd)
    sha256 = {f"r{r},A": r for r in records}
    return Run(name, Path(name), parameters={"k": figures}, sha256=sha256, spec=spec)


def only(before, after):
    (move,) = moves(before, after)
    return move


def test_runs_without_a_record_in_common_add_their_variances():
    move = only(run_of(3.0), run_of(4.0, 110.0, records=("b",)))
    assert move.rule == "independent"
    assert move.sd == pytest.approx(5.0)
    assert move.z == pytest.approx(2.0)
    assert move.bounds is None


def test_runs_that_share_records_do_not():
    move = only(run_of(3.0), run_of(4.0, 110.0, spec="x = 2"))
    assert move.rule == "shared"
    assert move.sd == pytest.approx(4.0)
    # The sd of the difference lies between |4 - 3| and 4 + 3.
    assert move.bounds == pytest.approx((10 / 7, 10.0))


def test_a_part_of_the_records_gives_the_difference_of_variances():
    move = only(run_of(5.0), run_of(3.0, 104.0, records=("a", "b")))
    assert move.rule == "nested"
    assert move.sd == pytest.approx(4.0)
    assert only(run_of(5.0), run_of(5.0, 104.0, records=("a", "b"))).sd == LEAST_SHARE * 5.0
    other = run_of(3.0, 104.0, records=("a", "b"), spec="x = 2")
    assert only(run_of(5.0), other).rule == "shared"


def test_the_rule_of_nested_records_is_right_for_a_mean():
    """Means of 20 readings and of the same with 60 more: the sd of their difference."""
    rng = np.random.default_rng(5)
    readings = rng.standard_normal((4000, 80))
    few, all_of_them = readings[:, :20].mean(axis=1), readings.mean(axis=1)
    move = only(run_of(1 / math.sqrt(20)), run_of(1 / math.sqrt(80), records=("a", "b")))
    # 4000 differences tell an sd to 1.1 % (1 sd).
    assert np.std(all_of_them - few) == pytest.approx(move.sd, rel=0.04)
    assert math.hypot(1 / math.sqrt(20), 1 / math.sqrt(80)) > 1.25 * move.sd


def test_the_same_records_and_model_again_are_told_so():
    assert sharing(run_of(), run_of()).rule == "repeated"
    assert sharing(run_of(), run_of(records=())).rule == "unknown"


def test_numbers_over_orders_are_compared_in_logarithms():
    wide = Figures("N s/m", 1e5, 9e4, 2e4, 5e5)
    wider = Figures("N s/m", 1e6, 9e5, 2e5, 5e6)
    one = Run("a", Path("a"), parameters={"mu": wide}, sha256={"r": "a"})
    other = Run("b", Path("b"), parameters={"mu": wider}, sha256={"r": "b"})
    move = only(one, other)
    assert move.logarithms
    assert move.difference == pytest.approx(math.log(10.0))
    assert move.sd == pytest.approx(math.sqrt(2.0) * math.log(25.0) / SDS_IN_90)


def test_a_seed_or_a_title_is_no_other_model():
    one, other = (run_of(spec=f'title = "{t}"\nx = 1\n[sampler]\nseed = {t}') for t in (1, 2))
    assert same_model(one, other)
    assert not same_model(one, run_of(spec="x = 2"))
    assert not same_model(run_of(spec=""), run_of(spec=""))


def test_what_differs_is_told(tmp_path):
    first = make(tmp_path / "first")
    second = make(
        tmp_path / "second",
        more=', "coulomb-friction"',
        factor=1.5,
        digest="b" * 64,
        seed=7,
        gap=1.4,
    )
    found = compare([first, second]).compared
    told = {(d.sort, d.name): d.values for d in found.differing}
    assert told["effect", "coulomb-friction"] == ("no", "yes")
    assert told["prior", "k_LC.lognormal.factor"] == ("2.0", "1.5")
    assert told["record", "frame-1,A"] == ("a" * 12, "b" * 12)
    assert told["seed", "seed"] == ("1", "7")
    assert ("version", "rigid") not in told
    (row,) = [g for g in found.gaps if g.says]
    assert (row.record, row.channel, row.gaps) == ("frame-1", "load", (1.0, 1.4))


def test_a_record_that_one_run_lacks_is_told_once():
    both = '[[records]]\nname = "a"\nkind = "frame"\n'
    more = both + '[[records]]\nname = "b"\nkind = "release"\nfile = "b.csv"\n'
    found = differences([run_of(spec=both), run_of(spec=more)])
    listed = [(d.name, d.values) for d in found if d.sort == "spec"]
    assert listed == [("records[b].name", ("not there", '"b"'))]


def test_a_command_writes_page_and_files(tmp_path, capsys):
    first, second = (
        make(tmp_path / "a" / "run"),
        make(tmp_path / "b" / "run", 7e7, seed=2, factor=3),
    )
    out = tmp_path / "out"
    assert command.main([str(first), str(second), "--out", str(out), "--quiet"]) == 0
    assert "k_LC" in capsys.readouterr().out
    made = json.loads((out / "compare.json").read_text("utf-8"))
    assert [run["name"] for run in made["runs"]] == ["a/run", "b/run"]
    assert made["sharing"][0]["rule"] == "shared"
    k_lc = next(m for m in made["moved"] if m["parameter"] == "k_LC")
    assert k_lc["z"] == pytest.approx(1e7 / 1.2e6)
    rows = list(csv.DictReader((out / "comparison.csv").read_text("utf-8").splitlines()))
    assert len(rows) == len(made["moved"]) == len(fake.parameters())
    page = (out / "index.html").read_text("utf-8")
    for name in ("moved", "friction", "gaps"):
        assert f'id="fig-compare-{name}"' in page
        assert (out / "figures" / f"compare-{name}.csv").is_file()
    assert "not the root of the sum of squares" in page
    assert not re.search(r"<script|<link", page)


def test_an_unusable_run_makes_the_comparison_unusable(tmp_path, capsys):
    first, second = make(tmp_path / "a"), make(tmp_path / "b", usable=False, seed=2)
    assert command.main([str(first), str(second), "--out", str(tmp_path / "out")]) == 1
    assert "after 100 steps" in capsys.readouterr().err
    made = json.loads((tmp_path / "out" / "compare.json").read_text("utf-8"))
    assert [check["ok"] for check in made["checks"]] == [True, False]
    assert made["checks"][1]["says"] == "converged: after 100 steps"
    assert "must not be used" in (tmp_path / "out" / "index.html").read_text("utf-8")


def test_three_runs_are_compared_with_the_first(tmp_path):
    runs = [make(tmp_path / name, 6e7 + 1e6 * i, seed=i) for i, name in enumerate("abc")]
    found = compare(runs)
    assert set(found.moved()["run"]) == {"b", "c"}
    found.write(tmp_path / "out")
    assert (tmp_path / "out" / "index.html").stat().st_size > 1e4


def test_files_instead_of_folders_and_what_they_miss(tmp_path):
    folder = make(tmp_path / "a")
    stored, result = read_run(folder / "posterior.nc"), read_run(folder / "result.json")
    assert stored.parameters["k_LC"].median == pytest.approx(6e7, rel=0.01)
    assert stored.parameters["zero[load,A]"].unit == "N"
    assert stored.friction is not None
    assert result.friction is None
    assert "no posterior.nc" in result.notes[0]
    assert "no result.json" in stored.notes[0]
    # Neither usable nor a gap is made up.
    assert stored.usable is None
    page = compared(read_runs([folder / "posterior.nc", make(tmp_path / "b") / "result.json"]))
    assert page.usable


def test_folders_of_other_commands_get_a_sentence(tmp_path):
    folder = tmp_path / "field"
    (folder / "bands").mkdir(parents=True)
    (folder / "discovery.json").write_text(
        '{"verdict": "named", "steps": [{"effect": "piston-leakage"}], "gap": {}}', "utf-8"
    )
    line = {
        "place": "A", "quantity": "peak load", "unit": "N", "median": 9e4, "q05": 8e4, "q95": 1e5,
        "combined": 6e3, "parts": {},
    }  # fmt: skip
    bands = {"usable": True, "simulated": True, "records": {"field-1": {"budget": [line]}}}
    (folder / "bands" / "bands.json").write_text(json.dumps(bands), "utf-8")
    found = compared(read_runs([folder, make(tmp_path / "fit")]))
    assert any("named: piston-leakage" in told for told in found.others)
    assert any("bands of field-1" in told for told in found.others)
    assert found.runs[0].parameters["peak load[field-1,A]"].sd == 6e3
    assert found.moved == ((),)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((), "two or more"),
        (("a",), "two or more"),
        (("a", "a"), "given twice"),
        (("a", "nowhere"), "no such file"),
        (("a", "empty"), "holds no result"),
        (("a", "broken"), "no JSON"),
    ],
)
def test_what_is_no_comparison_is_refused(tmp_path, given, says):
    make(tmp_path / "a")
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "result.json").write_text("{", "utf-8")
    with pytest.raises(InputError, match=says):
        read_runs([tmp_path / name for name in given])


def test_text_of_a_file_is_text(tmp_path):
    first, second = make(tmp_path / "a"), make(tmp_path / "b", seed=2)
    result = json.loads((second / "result.json").read_text("utf-8"))
    result["gap"]["records"]["<script>alert(1)</script>"] = {"load": 3.0}
    (second / "result.json").write_text(json.dumps(result), "utf-8")
    compare([first, second]).write(tmp_path / "out")
    assert "<script>" not in (tmp_path / "out" / "index.html").read_text("utf-8")


@pytest.mark.slow
def test_a_real_pair_with_and_without_an_effect(tmp_path):
    """The same records with friction with memory and without: shared, and the effect is told."""
    import small_campaign

    import rigid

    small_campaign.make(tmp_path, ess=100.0, r_hat=1.1)
    spec = tmp_path / "specs" / "own.toml"
    text = spec.read_text("utf-8")
    plain = spec.with_name("plain.toml")
    plain.write_text(text.replace('\n    "frequency-dependent-friction",', ""), "utf-8")
    for path in (spec, plain):
        rigid.load(path).fit(tmp_path / path.stem, quiet=True)
    found = compare([tmp_path / "plain", tmp_path / "own"]).compared
    assert found.sharings[0].rule == "shared"
    assert len(found.sharings[0].common) == 4
    told = {(d.sort, d.name): d.values for d in found.differing}
    assert told == {("effect", "frequency-dependent-friction"): ("no", "yes")}
    assert {"k_LC", "mu"} <= {move.parameter for move in found.moved[0]}
    assert all(run.friction is not None for run in found.runs)


@pytest.mark.parametrize(
    ("percent", "told"), [(22.11, "+22"), (0.0987, "+0.099"), (99.6, "+100"), (-0.004, "0")]
)
def test_a_change_has_two_digits_and_no_sign_where_it_is_none(percent, told):
    assert _signed(percent) == told
