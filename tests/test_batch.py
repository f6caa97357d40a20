"""A season of tests: every spec of a folder fitted, one page over all, drift told from scatter."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cart import SPEC, write_cart

import rigid
from rigid.inference.drift import ALPHA, DIFFERS, DRIFTS, STEADY, drift
from rigid.inference.posterior import load_posterior
from rigid.report.season.output import as_row, quantities
from rigid.study.season import SeasonFit, in_order, season

ROOT = Path(rigid.__file__).parents[1]
GOOD = {"usable": True, "why": [], "title": "", "simulated": True, "gap": 1.0, "settings": [],
        "seed": 1, "parameters": {}}  # fmt: skip
DRAGS = {"day-1": 120.0, "day-2": 130.0, "day-10": 140.0}


def batch(*arguments, cwd):
    return subprocess.run(
        [sys.executable, "-m", "rigid", "batch", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        timeout=600,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three carts whose drag grows, a spec with a mistake, one without its record, one of bands."""
    made = tmp_path_factory.mktemp("season") / "spring"
    made.mkdir()
    for number, (name, drag) in enumerate(DRAGS.items()):
        write_cart(made, name, drag, seed=number, seconds=8.0)
    (made / "wrong.toml").write_text(SPEC.replace("kind", "kin"), "utf-8")
    (made / "lost.toml").write_text(SPEC.replace("cart.csv", "lost.csv"), "utf-8")
    (made / "empty.toml").write_text("title = 'Bands alone'\nrecords = []\n", "utf-8")
    return made


@pytest.fixture(scope="module")
def done(folder):
    """The command on two workers, in a folder of its own."""
    run = batch(str(folder), "--workers", "2", "--quiet", cwd=folder.parent)
    assert run.returncode == 1, run.stderr
    return run, folder.parent / "reports" / "spring"


@pytest.mark.slow  # three fits on two workers
def test_a_failed_spec_never_stops_the_others(done):
    run, out = done
    made = json.loads((out / "batch.json").read_text("utf-8"))
    status = {one["name"]: one["status"] for one in made["campaigns"]}
    assert list(status) == ["day-1", "day-2", "day-10", "empty", "lost", "wrong"]
    assert [status[name] for name in DRAGS] == ["usable"] * 3
    assert (status["empty"], status["lost"], status["wrong"]) == ("not fitted", "failed", "failed")
    why = {one["name"]: " ".join(one["why"]) for one in made["campaigns"]}
    assert "lost.csv" in why["lost"]
    assert "did you mean 'kind'?" in why["wrong"]
    assert not made["usable"]
    assert "3 of 5 campaigns gave a usable result; 2 could not be fitted." in run.stdout
    for name in DRAGS:
        files = {p.name for p in (out / name).iterdir()}
        assert {"index.html", "posterior.nc", "result.json", "summary.csv"} <= files
        assert f'href="{name}/index.html"' in (out / "index.html").read_text("utf-8")


@pytest.mark.slow
def test_the_numbers_are_those_of_the_fit_by_itself_and_what_drifts_is_named(done, folder):
    _, out = done
    made = json.loads((out / "batch.json").read_text("utf-8"))
    alone = rigid.load(folder / "day-2.toml").fit(quiet=True)
    table = made["campaigns"][1]["parameters"]
    for row in alone.result.parameters:
        assert table[row.name]["median"] == row.summary.median  # to the bit
    assert made["quantities"]["mu"]["verdict"] == DRIFTS
    assert made["quantities"]["M_Pl"]["verdict"] == STEADY
    slope = made["quantities"]["mu"]["change_per_campaign"]
    error = made["quantities"]["mu"]["change_error"]
    assert abs(slope - math.log(140.0 / 120.0) / 2.0) < 4.0 * error
    told = load_posterior(out / "day-2" / "posterior.nc").attrs["spec_folder"]
    assert (out / "day-2" / told).resolve() == folder.resolve()


@pytest.mark.slow
def test_what_is_done_is_not_done_again(done, folder):
    _, out = done
    before = (out / "day-1" / "posterior.nc").stat().st_mtime_ns
    lines = len((out / "rows.jsonl").read_text("utf-8").splitlines())
    (folder / "lost.csv").write_bytes((folder / "day-1.csv").read_bytes())
    run = batch(str(folder), "--resume", "--json", "--quiet", cwd=folder.parent)
    made = json.loads(run.stdout)
    assert run.returncode == 1  # 'wrong' still is
    assert {one["name"]: one["status"] for one in made["campaigns"]}["lost"] == "usable"
    assert len((out / "rows.jsonl").read_text("utf-8").splitlines()) == lines + 1
    assert (out / "day-1" / "posterior.nc").stat().st_mtime_ns == before


@pytest.mark.parametrize(("failed", "status"), [([2], 1), ([3], 3), ([2, 3], 3), ([], 0)])
def test_a_fit_that_found_the_disk_full_shows_in_the_status(failed: list[int], status: int):
    rows = [{"job": "good", "failed": None, "value": GOOD, "cost": {"cpu_s": 1.0}}]
    rows += [
        {"job": f"{n}", "failed": {"status": n, "says": "why"}, "cost": {"cpu_s": 1.0}}
        for n in failed
    ]
    done = SeasonFit(Path("spring"), [{"name": row["job"]} | as_row(row) for row in rows])
    assert done.status == status
    assert [one.get("exit_status") for one in done.result["campaigns"]] == [None, *failed]
    assert done.usable == (status == 0)


@pytest.mark.slow
def test_what_is_no_folder_of_specs_is_the_inputs_fault(tmp_path: Path):
    for name, says in (("none", "there is no such folder"), ("", "holds no spec")):
        run = batch(str(tmp_path / name), cwd=tmp_path)
        assert (run.returncode, run.stdout) == (2, "")
        assert says in run.stderr
    assert list(tmp_path.iterdir()) == []


def test_campaigns_come_in_the_order_of_their_numbers(tmp_path: Path):
    names = ["a-10", "a-2", "a-1", "b", "10", "9"]
    assert sorted(names, key=in_order) == ["9", "10", "a-1", "a-2", "a-10", "b"]
    for name in names:
        (tmp_path / f"{name}.toml").write_text("records = []\n", "utf-8")
    assert list(season(tmp_path).listed) == sorted(names, key=in_order)


def test_numbers_of_a_record_are_no_properties_of_the_rig():
    def campaign(k: float) -> dict:
        figures = {"unit": "1", "median": k, "q05": 0.99 * k, "q95": 1.01 * k}
        return {
            "status": "usable",
            "settings": ["kappa[free-run-2,A]"],
            "parameters": {"k_LC": figures, "kappa[free-run-2,A]": figures},
        }

    found = quantities([campaign(1.0), campaign(1.5), {"status": "failed"}])
    assert list(found) == ["k_LC"]
    assert found["k_LC"]["verdict"] == DIFFERS
    assert found["k_LC"]["trend_p"] is None


# Drift


def estimates(rng, truth, sd):
    """Medians and 90 % intervals of normal estimates of log-quantities."""
    middle = np.log(truth) + sd * rng.standard_normal(len(truth))
    return tuple(np.exp(middle + k * 1.6448536269514722 * sd) for k in (0.0, -1.0, 1.0))


def test_tests_of_drift_have_their_size_and_see_what_is_there():
    """Of 4000 steady seasons a share p < 0.05 within 4 sds of its own sampling error."""
    rng, when, sd = np.random.default_rng(1), np.arange(8.0), 0.02
    steady = [drift(*estimates(rng, np.full(8, 6e7), sd), when) for _ in range(4000)]
    bound = 4.0 * math.sqrt(0.05 * 0.95 / 4000)
    for p in ([d.trend_p for d in steady], [d.scatter_p for d in steady]):
        assert abs(np.mean(np.array(p) < 0.05) - 0.05) < bound
    # too small an error, and the size is lost: what the test above would see
    wrong = [drift(m, m * 0.98, m * 1.02, when) for m, _, _ in
             (estimates(rng, np.full(8, 6e7), sd) for _ in range(1000))]  # fmt: skip
    assert np.mean([d.scatter_p < 0.05 for d in wrong]) > 0.05 + bound
    trend = drift(*estimates(rng, 6e7 * np.exp(0.02 * when), sd), when)
    assert trend.verdict(2) == DRIFTS
    assert abs(trend.slope - 0.02) < 4.0 * trend.slope_error
    jumps = drift(*estimates(rng, 6e7 * np.exp(0.1 * np.array([0, 1, 0, 1, 1, 0, 1, 0])), sd), when)
    assert jumps.verdict(2) == DIFFERS
    assert jumps.trend_p > ALPHA


def test_one_campaign_says_nothing_of_drift_and_what_has_no_width_is_left_out():
    one = drift(np.array([2.0]), np.array([1.0]), np.array([3.0]), np.zeros(1))
    assert (one.trend_p, one.scatter_p, one.verdict(1)) == (None, None, STEADY)
    assert drift(np.ones(2), np.ones(2), np.ones(2), np.arange(2.0)) is None
    below = drift(
        np.array([-1.0, 1.0]), np.array([-2.0, 0.0]), np.array([0.0, 2.0]), np.arange(2.0)
    )
    assert not below.logarithmic
    assert below.mean == pytest.approx(0.0, abs=1e-15)
