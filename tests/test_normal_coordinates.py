"""Normal coordinates: bent sheets become straight, volumes stay, and nothing else changes."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import release_problem

from rigid.inference.adaptation import drawn
from rigid.inference.coordinates import Chart
from rigid.inference.newton import expanded, is_noise, joined, local
from rigid.inference.normal_coordinates import bend_of, normal_chart
from rigid.inference.proposal import MixtureProposal
from rigid.inference.search import Optimum, search

NAMES = ("stiffness", "mass", "frame", "noise")
NONE_HELD = np.zeros(4, dtype=bool)
DRAWS, DOF = 4096, 16.0
KNOWN = np.array([2e-4, 4e-4])
"""Errors with which two combinations are measured, in logarithms."""
WIDTHS = np.array([0.7, 0.1, 0.1, 1.0])
"""Of the priors, in logarithms; the fourth number is measured by nothing."""


def combinations(z: np.ndarray) -> np.ndarray:
    """A stiffness over a mass, and the compliance of two springs in a row, (..., 2)."""
    stiffness, mass, frame, _ = np.moveaxis(WIDTHS * z, -1, 0)
    return np.stack([stiffness - mass, np.logaddexp(-stiffness, -frame)], axis=-1)


def density(z: np.ndarray) -> np.ndarray:
    off = (combinations(z) - combinations(np.zeros(4))) / KNOWN
    return -0.5 * np.sum(off**2, axis=-1) - 0.5 * np.sum(z**2, axis=-1)


def information(z: np.ndarray) -> np.ndarray:
    step = 1e-6 * np.eye(4)
    slopes = (combinations(z + step) - combinations(z - step)) / 2e-6 / KNOWN
    return slopes @ slopes.T + np.eye(4)


def optimum() -> Optimum:
    at = np.zeros(4)
    return Optimum(at, np.zeros((0, 2)), np.linalg.inv(information(at)), 0.0, 1, 0.0)


@pytest.fixture(scope="module")
def chart() -> Chart:
    return Chart(NAMES, (), bend_of(information, optimum(), NONE_HELD))


def covered(chart: Chart) -> float:
    law = MixtureProposal((chart.mode(optimum()),), np.ones(1), DOF)
    return drawn(chart.density(density), law, np.random.default_rng(1), DRAWS).even


def test_a_bent_sheet_is_covered_in_normal_coordinates(chart: Chart):
    """In z hardly a draw counts, though the law is exact at the optimum; seeds 2 and 3 as well."""
    assert covered(Chart(NAMES, ())) < 0.1
    assert covered(chart) > 0.9


def test_symbols_of_one_side_alone_leave_the_sheet_bent(chart: Chart):
    assert chart.bend is not None
    wrong = dataclasses.replace(chart.bend, symbols=-chart.bend.symbols)
    assert covered(dataclasses.replace(chart, bend=wrong)) < 0.1


def hardly_told(z: np.ndarray) -> np.ndarray:
    """Information of a reading that grows twentyfold with one number, and moves with another."""
    slopes = np.zeros((4, 1))
    slopes[:2, 0] = 0.9 * np.exp(3.0 * z[0]) * np.array([1.0 + z[1], 1.0])
    return slopes @ slopes.T + np.diag([1.0, 1.0, 1.0, 1e4])


def test_directions_that_the_priors_tell_are_not_folded():
    """Folds took draws of the law to twenty prior sds here, and held chains where they began."""
    best = dataclasses.replace(optimum(), covariance=np.linalg.inv(hardly_told(np.zeros(4))))
    chart = Chart(NAMES, (), bend_of(hardly_told, best, NONE_HELD))
    law = MixtureProposal((chart.mode(best),), np.ones(1), DOF)
    drawn_z = chart.standard(law.sample(np.random.default_rng(1), DRAWS))
    assert np.abs(drawn_z).max() < 7.0
    assert np.all(drawn_z.std(axis=0) < 1.3)


def test_there_and_back_and_volumes(chart: Chart):
    z = 2.0 * np.random.default_rng(0).standard_normal((50, 4))
    before = z.copy()
    u = chart.straight(z)
    np.testing.assert_array_equal(z, before)
    assert np.abs(u - z).max() > 0.1
    np.testing.assert_allclose(chart.standard(u), z, atol=1e-12)
    step = 1e-6
    for at in 0.5 * z[:5]:
        up, down = (chart.straight(at + sign * step * np.eye(4)) for sign in (1.0, -1.0))
        slopes = ((up - down) / (2.0 * step)).T
        np.testing.assert_allclose(chart.slopes(at), slopes, atol=1e-5)
        assert abs(np.linalg.det(slopes)) == pytest.approx(1.0, abs=1e-4)


def test_what_cannot_be_simulated_is_taken_for_straight():
    def nowhere(z: np.ndarray) -> np.ndarray:
        return np.full((4, 4), np.nan)

    z = np.random.default_rng(0).standard_normal((5, 4))
    straight = Chart(NAMES, (), bend_of(nowhere, optimum(), NONE_HELD))
    np.testing.assert_allclose(straight.straight(z), z, atol=1e-14)


def test_coordinates_of_a_rig_have_their_optimum_and_its_law():
    found = search(release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64), 4, 1)
    chart, best = normal_chart(found), found.optima[0]
    np.testing.assert_allclose(chart.straight(best.z), best.z, atol=1e-12)
    np.testing.assert_allclose(chart.straightened(best).covariance, best.covariance, rtol=1e-9)
    bend = chart.bend
    assert bend is not None
    assert np.abs(bend.symbols).max() > 1e-3


def test_an_expansion_is_that_of_the_samples():
    problem = release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64)
    w = joined(problem, np.full(problem.parameters.size, 0.1), np.zeros((len(problem.sensors), 2)))
    noise = np.zeros(int(is_noise(problem).sum()))
    by_itself = local(problem, jnp.asarray(w), jnp.asarray(noise))
    for one, other in zip(expanded(problem, w, noise), by_itself, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
