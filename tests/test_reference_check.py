"""The fast solver against diffrax at the points of an answer: it passes, and it can fail."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import frame_problem, release_problem

from rigid.inference.reference_check import (
    FIRST,
    SensorError,
    SolverCheck,
    against_reference,
    until_clear,
)
from rigid.inference.summary import Check
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.problem import predict
from rigid.localfit.samples import lay_out
from rigid.physics import full, slow
from rigid.validation.solved import seldom_off, solved

NO_END = {"ended": False, "bars": None, "per": None, "sensor": None, "difference": None}
NOT_ENDED = "diffrax did not come to its end in 3"


@pytest.fixture(scope="module")
def problem():
    return frame_problem()


def draws(problem, spread: float = 0.05) -> np.ndarray:
    return spread * np.random.default_rng(5).standard_normal((12, problem.parameters.size))


@pytest.mark.slow
def test_steps_agree_with_diffrax(problem):
    z = draws(problem)
    found = against_reference(problem, z[0], z, seed=1)
    assert found is not None
    assert found.ok, found.says
    assert (found.points, found.ended) == (FIRST, FIRST)  # of 13: no more are asked
    assert {s.quantity for s in found.sensors} == set(SlowGroup.quantities)
    assert 0.0 < found.worst.bars < 0.1
    assert found.values()["shift"] == found.shift
    assert f"{FIRST} points" in found.check.says
    told = solved(problem, z[0])
    assert told is not None
    assert told["ended"]
    assert 0.0 < told["bars"] <= found.worst.bars * 1.01
    assert json.loads(json.dumps(told)) == told  # goes into a row


@pytest.mark.slow
def test_samples_count_in_a_problem_as_they_are_weighed(problem):
    layout = lay_out(problem)
    weight = layout.weight * np.random.default_rng(3).uniform(size=len(layout.weight))
    again = lay_out(layout.weighed(weight).weighed_problem)
    np.testing.assert_array_equal(again.weight, weight)


@pytest.mark.slow
def test_a_solver_that_reads_wrong_is_found(problem, monkeypatch):
    """Pressures 1 % too high: a hundred bar are off by 1 bar, three steps of the gauge."""
    right = slow.march

    def wrong(*given):
        out = right(*given)
        return out | {"pressure": 1.01 * out["pressure"]}

    monkeypatch.setattr("rigid.likelihood.groups.slow.march", wrong)
    jax.clear_caches()
    z = draws(problem)
    found = against_reference(problem, z[0], z, seed=1)
    told = solved(problem, z[0])
    jax.clear_caches()
    assert found is not None
    assert not found.ok
    assert found.points == 13
    assert found.worst.quantity == "pressure"
    assert found.worst.bars > 0.5
    assert "pressure of frame-1,A" in found.says
    assert told is not None
    assert told["bars"] > 0.5
    check = seldom_off([{"solver": told}] * 4)
    assert check is not None
    assert not check.ok
    assert "pressure of frame-1,A" in check.says


def test_an_error_that_goes_with_the_parameters_is_found_though_no_reading_shows_it():
    small = SensorError("load", "N", 1.0, 295.0, "step", "frame-1,A")
    differences = 0.3 * np.random.default_rng(2).standard_normal(32)
    found = SolverCheck(1e-8, 32, 32, (small,), differences)
    assert not found.ok
    assert found.shift == pytest.approx(np.std(differences))
    # The same everywhere: no draw is more probable than it was.
    assert dataclasses.replace(found, differences=np.full(32, 0.3)).ok


@pytest.mark.parametrize(
    ("bars", "shift", "lost", "points"),
    [(0.16, 0.03, 0, FIRST), (0.17, 0.03, 0, 32), (0.16, 0.034, 0, 32), (0.16, 0.03, 1, 32)],
)
def test_more_points_are_solved_where_the_first_leave_a_doubt(bars, shift, lost, points):
    def first(count: int) -> SolverCheck:
        worst = SensorError("load", "N", bars * 295.0, 295.0, "step", "frame-1,A")
        differences = np.tile([shift, -shift], count // 2)[: count - lost]
        return SolverCheck(1e-8, count, count - lost, (worst,), differences)

    assert until_clear(first, 32).points == points
    assert until_clear(first, 4).points == 4


def test_a_mean_moves_by_no_more_than_is_said():
    """Weights exp(d) against the bound, for d that goes with a quantity and d that does not."""
    rng = np.random.default_rng(3)
    q, other = rng.standard_normal((2, 200_000))
    for d in (0.1 * q, 0.1 * other, 0.07 * (q + other)):
        found = SolverCheck(1e-8, 1, 1, (), d)
        moved = np.average(q, weights=np.exp(d)) - q.mean()
        assert abs(moved) < 1.1 * found.shift + 4 / np.sqrt(len(q))


@pytest.mark.slow
def test_a_solve_that_does_not_end_is_no_proof(problem, monkeypatch):
    monkeypatch.setattr(full, "MAX_STEPS", 3)
    z = draws(problem)
    found = against_reference(problem, z[0], z, seed=1, tolerance=2e-8)
    jax.clear_caches()
    assert found is not None
    assert (found.ended, found.ok, found.worst) == (0, False, None)
    assert "did not come to its end" in found.says
    assert found.values()["shift"] is None
    assert seldom_off([{"solver": NO_END}] * 3) == Check("solver", False, NOT_ENDED)


def test_campaigns_in_which_the_solver_errs_are_counted_beyond_chance():
    """One in 40 is what one in fifty makes by chance; eight are not."""
    good = {"ended": True, "bars": 0.02, "per": "step", "sensor": "load of a,A", "difference": 0.1}
    bad = good | {"bars": 0.9, "difference": -2.0}

    def check(listed: list[dict]) -> Check:
        found = seldom_off([{"solver": one} for one in listed])
        assert found is not None
        return found

    few = check([good] * 39 + [bad])
    assert few.ok
    assert "0.9 steps" in few.says
    assert "in 1; the log-posterior by 0.1 in half of them, 2 at most" in few.says
    assert not check([good] * 32 + [bad] * 8).ok
    assert not check([good] * 8 + [NO_END] * 2).ok
    assert check([good] * 19 + [NO_END]).ok
    assert seldom_off([{}, {"solver": None}]) is None  # older rows; motions, which nothing solves


@pytest.mark.slow
def test_the_problem_of_a_spec_by_diffrax_predicts_by_it_and_has_its_slopes(problem):
    exact = problem.with_tolerance(1e-9)
    z = jnp.asarray(draws(problem)[:2])
    by_steps, by_diffrax = predict(problem, z), predict(exact, z)
    bars = {"load": 29.5, "stroke": 2.2e-5, "pressure": 3447.4}  # tenths of the sensors' steps
    for quantity, bar in bars.items():
        off = np.abs(np.asarray(by_steps[0][quantity]) - np.asarray(by_diffrax[0][quantity]))
        assert 0.0 < off.max() < bar, quantity

    def slope(problem):
        along = jax.jvp(problem.log_posterior, (z,), (jnp.ones_like(z),))
        return np.asarray(along[1])

    np.testing.assert_allclose(slope(exact), slope(problem), rtol=1e-3)


@pytest.mark.slow
def test_releases_are_held_against_diffrax_as_well():
    problem = release_problem({})
    z = draws(problem)
    found = against_reference(problem, z[0], z, seed=1)
    assert found is not None
    assert found.ok, found.says
    assert [s.per for s in found.sensors] == ["noise"]
