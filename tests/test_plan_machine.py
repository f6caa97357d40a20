"""The next record of a machine that a spec puts together: what may be taken, what it tells."""

import numpy as np
import pytest
from machines import simulated
from machines.loading import machine

import rigid
from rigid.inference.derived import values_of
from rigid.inference.newton import is_noise
from rigid.inference.reference_check import FIRST, POINTS
from rigid.inference.search import search
from rigid.planning.change import Change, changed, placed, stated
from rigid.planning.limits import driven
from rigid.planning.quantity import quantity_of, slope


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "setting", "number"),
    [
        ("press", "flow", "kappa[squeeze,head]"),
        ("swing", "drive", "x_start[decay,body]"),
        ("shaker", "drive", ""),
    ],
)
def test_what_can_be_changed_is_what_drives_a_run(name, setting, number, tmp_path):
    study = machine(name, tmp_path)
    run = study.spec.records[0].name
    changes = stated(study.spec, study.problem)
    assert changes == tuple(
        Change(run, **{setting: factor}) if factor != 1.0 else Change(run)
        for factor in (0.5, 1.0, 2.0)
    )
    new = changed(study.spec, study.records, study.problem, changes[-1:])
    z = np.full(study.problem.parameters.size, 0.2)
    before, after = (
        values_of(study.problem, one[None])
        for one in (z, placed(study.problem, new, changes[-1:], z))
    )
    moved = {label for label in before if float(after[label][0]) != float(before[label][0])}
    begun = {label for label in before if label.startswith(("x_start", "v_start"))}
    assert moved == (begun or ({number} if number else set()))
    for label in moved:
        assert float(after[label][0]) == pytest.approx(2.0 * float(before[label][0]), rel=1e-3)


@pytest.mark.slow
def test_a_command_is_driven_along_straight_lines(tmp_path):
    study = machine("shaker", tmp_path)
    change = Change("sweep", drive=0.5, interval=0.5)
    new = changed(study.spec, study.records, study.problem, (change,))
    was, now = (
        next(np.asarray(t.given.command) for t in problem.tracks if t.label == "sweep,head")
        for problem in (study.problem, new)
    )
    half = min(len(was), (len(now) + 1) // 2)
    np.testing.assert_allclose(now[: 2 * half : 2][:half], 0.5 * was[:half], atol=1e-9)
    middle = 0.25 * (was[: half - 1] + was[1:half])
    np.testing.assert_allclose(now[1 : 2 * half - 1 : 2], middle, atol=1e-6)
    assert driven(new, change)["command"] == pytest.approx(0.5 * np.abs(was).max())


@pytest.mark.slow
def test_a_second_run_tells_what_was_expected(tmp_path):
    """Of a press, simulated by SciPy once more: 5 % for what its noise moves."""
    one = machine("press", tmp_path)
    expected = one.plan(("k_oil", "mu[head]"), quiet=True).result
    checks = {check["name"]: check["ok"] for check in expected["checks"]}
    assert checks == {"optimum": True, "posterior": True, "solver": True}
    assert expected["solver"]["points"] in (FIRST, POINTS)
    (again,) = (r for r in expected["records"] if r["record"] == "squeeze again")
    simulated.press(tmp_path / "again.csv", seed=2)
    first = one.spec.text.split("[[records]]", 1)[1]
    second = first.replace('"squeeze"', '"again"').replace("press.csv", "again.csv")
    both = tmp_path / "both.toml"
    both.write_text(f"{one.spec.text}\n[[records]]{second}", "utf-8")
    sds = []
    for study in (one, rigid.load(both)):
        problem = study.problem
        best, free = search(problem, 4, 1).optima[0], ~is_noise(problem)
        covariance = best.covariance[np.ix_(free, free)]
        slopes = [
            slope(quantity_of(problem, q["name"], "here").values, best.z)[free]
            for q in expected["quantities"]
        ]
        sds.append([float(np.sqrt(g @ covariance @ g)) for g in slopes])
    for before, after, promised in zip(*sds, again["expected"][::3], strict=True):
        assert promised["records"] == 1
        assert after / before == pytest.approx(promised["factor"], rel=0.05)
    assert again["expected"][0]["factor"] < 0.9
