"""The fast solver against diffrax at the points of an answer: it passes, and it can fail."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import frame_problem, release_problem

from rigid.inference.reference_check import SensorError, SolverCheck, against_reference
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.problem import predict
from rigid.localfit.samples import lay_out
from rigid.physics import full, slow


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
    assert (found.points, found.ended) == (13, 13)
    assert {s.quantity for s in found.sensors} == set(SlowGroup.quantities)
    assert 0.0 < found.worst.bars < 0.1
    assert found.values()["shift"] == found.shift
    assert "13 points" in found.check.says


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
    jax.clear_caches()
    assert found is not None
    assert not found.ok
    assert found.worst.quantity == "pressure"
    assert found.worst.bars > 0.5
    assert "pressure of frame-1,A" in found.says


def test_an_error_that_goes_with_the_parameters_is_found_though_no_reading_shows_it():
    small = SensorError("load", "N", 1.0, 295.0, "step", "frame-1,A")
    differences = 0.3 * np.random.default_rng(2).standard_normal(32)
    found = SolverCheck(1e-8, 32, 32, (small,), differences)
    assert not found.ok
    assert found.shift == pytest.approx(np.std(differences))
    # The same everywhere: no draw is more probable than it was.
    assert dataclasses.replace(found, differences=np.full(32, 0.3)).ok


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
