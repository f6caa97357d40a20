"""Coordinates along a ridge: bent sheets become straight, volumes stay, nothing else changes."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import release_problem

from rigid.inference import ridge
from rigid.inference.adaptation import drawn
from rigid.inference.coordinates import Bend, Chart
from rigid.inference.newton import Expansion, expanded, is_noise, joined, local
from rigid.inference.proposal import MixtureProposal
from rigid.inference.ridge import (
    SPREAD,
    Cloud,
    ConditionalMode,
    Directions,
    Local,
    bend_of,
    mode_at,
)
from rigid.inference.search import Optimum, search

NAMES = ("stiffness", "mass", "frame", "noise")
NONE_HELD, WIDE = np.zeros(4, dtype=bool), 0.1
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


def expansion(z: np.ndarray, others: np.ndarray) -> Expansion:
    """That of `density`, with nothing that is integrated out."""
    assert not others.size
    step = 1e-6 * np.eye(4)
    slopes = (combinations(z + step) - combinations(z - step)) / 2e-6 / KNOWN
    off = (combinations(z) - combinations(np.zeros(4))) / KNOWN
    return Expansion(float(-density(z)), slopes @ off + z, slopes @ slopes.T + np.eye(4))


def optimum() -> Optimum:
    at = np.zeros(4)
    covariance = np.linalg.inv(expansion(at, np.empty(0)).information)
    return Optimum(at, np.zeros((0, 2)), covariance, 0.0, 1, 0.0)


def bend() -> Bend:
    found = bend_of(expansion, optimum(), NONE_HELD, WIDE).bend
    assert found is not None
    return found


def straightened(local: Local, best: Optimum) -> Chart:
    found = bend_of(local, best, NONE_HELD, WIDE).bend
    return Chart(NAMES, (), (found,) if found else ())


@pytest.fixture(scope="module")
def chart() -> Chart:
    return Chart(NAMES, (), (bend(),))


def covered(chart: Chart) -> float:
    law = MixtureProposal((chart.mode(optimum()),), np.ones(1), DOF)
    return drawn(chart.density(density), law, np.random.default_rng(1), DRAWS).even


def test_a_bent_sheet_is_covered_along_its_ridge(chart: Chart):
    """In z hardly a draw counts, though the law is exact at the optimum; seeds 2 and 3 as well."""
    assert covered(Chart(NAMES, ())) < 0.1
    assert covered(chart) > 0.9


def test_a_wrong_polynomial_leaves_the_sheet_bent(chart: Chart):
    wrong = dataclasses.replace(bend(), coefficients=-bend().coefficients)
    assert covered(dataclasses.replace(chart, bends=(wrong,))) < 0.1


def hardly_told(z: np.ndarray, others: np.ndarray) -> Expansion:
    """Of a reading that grows twentyfold with one number and moves with another, and noise of 1."""
    grown = 0.3 * np.exp(3.0 * z[0])
    off = grown * (1.0 + z[1]) - 0.3
    slopes = np.array([3.0 * grown * (1.0 + z[1]), grown, 0.0, 0.0])[:, None]
    own = np.diag([1.0, 1.0, 1.0, 1e4])
    value = 0.5 * off**2 + 0.5 * z @ own @ z
    assert not others.size
    return Expansion(value, slopes[:, 0] * off + own @ z, slopes @ slopes.T + own)


def test_directions_that_the_priors_tell_are_not_folded():
    """Folds took draws of the law to twenty prior sds here, and held chains where they began."""
    known = hardly_told(np.zeros(4), np.empty(0)).information
    best = dataclasses.replace(optimum(), covariance=np.linalg.inv(known))
    chart = straightened(hardly_told, best)
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


def test_points_go_where_the_posterior_is():
    """Modes at points of a unit cloud tell centre and sds of a law that is elsewhere and wider."""
    centre, sds = np.array([1.0, 0.0]), np.array([1.5, 1.0])
    cloud = Cloud(np.zeros(2), np.ones(2))
    w = cloud.points(np.random.default_rng(4).standard_normal((2048, 2)))
    value = 0.5 * np.sum(((w - centre) / sds) ** 2, axis=1)
    modes = [
        ConditionalMode(at, np.zeros(1), np.zeros((1, 2)), np.eye(1), v)
        for at, v in zip(w, value, strict=True)
    ]
    moved = cloud.moved(modes, cloud.log_density(w))
    np.testing.assert_allclose(moved.centre, centre, atol=0.15)
    np.testing.assert_allclose(moved.sds, sds, atol=0.15)
    few = cloud.moved(modes[:1], cloud.log_density(w[:1]))
    assert np.all(np.abs(few.centre) <= np.abs(w[0]) / 3.0 + 1e-12)


def test_far_points_are_those_of_the_prior():
    """Along what is told to 0.5 and 0.8 prior sds; along what is told to 0.2 as the posterior."""
    z = np.array([0.6, -0.3, 0.2, 0.0])
    widths = np.array([0.8, 0.5, 0.2])
    along = Directions(np.diag([*widths, 1e-3]), widths, 1)
    far = Cloud.of_prior(dataclasses.replace(optimum(), z=z), along)
    w = far.points(np.random.default_rng(2).standard_normal((4096, 3)))
    at = z[:3] + widths * w
    np.testing.assert_allclose(at.mean(axis=0), [0.0, 0.0, 0.2], atol=5.0 / 64.0)
    np.testing.assert_allclose(at.std(axis=0), [1.0, 1.0, 0.2 * SPREAD], atol=4.0 / 64.0)


def test_a_mode_is_found_from_afar_by_shorter_steps():
    """A full Newton step on log cosh from 1.5 leads away, and away from there for good."""

    def steep(z: np.ndarray, others: np.ndarray) -> Expansion:
        value = 100.0 * np.log(np.cosh(z[1] - z[0]))
        slope = 100.0 * np.tanh(z[1] - z[0]) * np.array([-1.0, 1.0])
        bend = 100.0 / np.cosh(z[1] - z[0]) ** 2 * np.outer([-1.0, 1.0], [-1.0, 1.0])
        return Expansion(value, slope, bend)

    best = Optimum(np.zeros(2), np.zeros((0, 2)), np.eye(2), 0.0, 1, 0.0)
    along = Directions(np.eye(2), np.ones(1), 1)
    found = mode_at(steep, best, along, np.array([1.5]), np.zeros(1))
    assert found is not None
    assert found.x[0] == pytest.approx(1.5, abs=0.2)
    np.testing.assert_allclose(found.slopes, [[1.0]])


def test_maps_follow_one_another(chart: Chart):
    """What is narrow in one map may bend what is narrower in the next; volumes stay."""
    twice = dataclasses.replace(chart, bends=(*chart.bends, *chart.bends))
    z = np.random.default_rng(0).standard_normal((5, 4))
    np.testing.assert_allclose(twice.standard(twice.straight(z)), z, atol=1e-11)
    for at in 0.5 * z:
        first = chart.slopes(at)
        second = chart.bends[0].slopes(chart.straight(at))
        np.testing.assert_allclose(twice.slopes(at), second @ first, atol=1e-9)
        assert abs(np.linalg.det(twice.slopes(at))) == pytest.approx(1.0, abs=1e-6)


def test_what_cannot_be_simulated_is_taken_for_straight():
    def nowhere(z: np.ndarray, others: np.ndarray) -> Expansion:
        return Expansion(np.nan, np.full(4, np.nan), np.full((4, 4), np.nan))

    assert bend_of(nowhere, optimum(), NONE_HELD, WIDE).bend is None


def test_what_cannot_be_simulated_on_one_side_is_left_out():
    def half(z: np.ndarray, others: np.ndarray) -> Expansion:
        return expansion(z, others) if z[0] > -0.3 else expansion(np.full(4, np.nan), others)

    found = bend_of(half, optimum(), NONE_HELD, WIDE).bend
    assert found is not None
    assert covered(Chart(NAMES, (), (found,))) > 0.3


def test_a_straight_posterior_stays_as_it_is():
    known = np.diag([1.0, 2.0, 1e4, 1e6])
    known[0, 2] = known[2, 0] = 30.0

    def straight(z: np.ndarray, others: np.ndarray) -> Expansion:
        return Expansion(float(0.5 * z @ known @ z), known @ z, known)

    best = dataclasses.replace(optimum(), covariance=np.linalg.inv(known))
    assert bend_of(straight, best, NONE_HELD, WIDE).bend is None


@pytest.mark.slow
def test_coordinates_of_a_rig_have_their_optimum_and_its_law(monkeypatch):
    monkeypatch.setattr(ridge, "STRAIGHT", 2.0)  # that of one release is straight enough as it is
    found = search(release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64), 4, 1)
    chart, best = ridge.ridge_of(found).chart, found.optima[0]
    assert chart.bends
    away = chart.bends[0].factor[:, 0] * 2.0
    assert np.abs(chart.straight(best.z + away) - best.z - away).max() > 1e-6
    np.testing.assert_allclose(chart.straight(best.z), best.z, atol=1e-12)
    np.testing.assert_allclose(chart.straightened(best).covariance, best.covariance, rtol=1e-9)


@pytest.mark.slow
def test_an_expansion_is_that_of_the_samples():
    problem = release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64)
    w = joined(problem, np.full(problem.parameters.size, 0.1), np.zeros((len(problem.sensors), 2)))
    noise = np.zeros(int(is_noise(problem).sum()))
    by_itself = local(problem, jnp.asarray(w), jnp.asarray(noise))
    for one, other in zip(expanded(problem, w, noise), by_itself, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
