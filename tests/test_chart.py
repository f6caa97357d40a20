"""Coordinates in which the parts of a well-known sum have a straight posterior."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import parameter as declared

from rigid.effects.base import PLUNGER, AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter
from rigid.inference.adaptation import drawn
from rigid.inference.coordinates import Chart, Sum, chart_of
from rigid.inference.proposal import MixtureProposal, Mode
from rigid.inference.search import Optimum
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.priors import Lognormal, Normal
from rigid.likelihood.problem import Problem

CENTRE, WIDTH = np.log([1e5, 5e5, 1e5]), np.log([10.0, 5.0, 5.0])
PLACES = np.array([3, 0, 1])  # the parts need not stand in a row; the third entry is none of them
SIZE = 4
CHART = Chart(("r1", "r2", "other", "total"), (Sum(PLACES, CENTRE, WIDTH),))
BEST = np.array([0.4, -0.3, 1.0, 0.2])
KNOWN = 1e-3
"""Relative error with which the records know the sum."""
DRAWS, DOF = 4096, 8.0


def sum_of(z: np.ndarray) -> np.ndarray:
    return np.exp(CENTRE + WIDTH * z[..., PLACES]).sum(axis=-1)


def density(z: np.ndarray) -> np.ndarray:
    """The prior, and one measurement of the sum."""
    off = np.log(sum_of(z) / sum_of(BEST)) / KNOWN
    return -0.5 * off**2 - 0.5 * (z**2).sum(axis=-1)


def at_the_best() -> Optimum:
    """The law that the curvature in z has on the sheet where the sum is right."""
    parts = np.exp(CENTRE + WIDTH * BEST[PLACES])
    slope = np.zeros(SIZE)
    slope[PLACES] = WIDTH * parts / parts.sum()
    precision = np.eye(SIZE) + np.outer(slope, slope) / KNOWN**2
    return Optimum(BEST, np.zeros((1, 2)), np.linalg.inv(precision), 0.0, 1, 0.0)


def test_there_and_back():
    z = np.random.default_rng(0).standard_normal((50, SIZE)) * 2.0
    before = z.copy()
    u = CHART.straight(z)
    np.testing.assert_array_equal(z, before)
    np.testing.assert_allclose(CHART.standard(u), z, atol=1e-12)
    np.testing.assert_allclose(np.exp(u[:, 3] * WIDTH[0]), sum_of(z), rtol=1e-12)
    np.testing.assert_array_equal(u[:, 2], z[:, 2])


def test_slopes_are_those_of_differences_and_keep_volumes():
    step = 1e-6
    up, down = (CHART.straight(BEST + sign * step * np.eye(SIZE)) for sign in (1.0, -1.0))
    slopes = ((up - down) / (2 * step)).T
    there = CHART.straightened(at_the_best())
    np.testing.assert_allclose(
        there.covariance, slopes @ at_the_best().covariance @ slopes.T, rtol=1e-5, atol=1e-9
    )
    assert abs(np.linalg.det(slopes)) == pytest.approx(1.0, abs=1e-6)


def test_an_optimum_comes_back_as_it_was():
    back = CHART.standardised(CHART.straightened(at_the_best()))
    np.testing.assert_allclose(back.z, BEST, atol=1e-12)
    np.testing.assert_allclose(back.covariance, at_the_best().covariance, atol=1e-9)


def drawn_around_the_best(chart: Chart):
    law = MixtureProposal((chart.mode(at_the_best()),), np.ones(1), DOF)
    return drawn(chart.density(density), law, np.random.default_rng(1), DRAWS)


def test_a_posterior_that_is_bent_in_z_is_covered_in_u():
    """In z no draw in a hundred counts, though the law around the best fit is exact there."""
    nothing = Chart(CHART.names, ())
    assert drawn_around_the_best(nothing).even < 0.01
    assert drawn_around_the_best(CHART).even > 0.2


def test_weighted_draws_have_the_posterior_of_a_part():
    """Against a grid over the two ratios, the sum being known."""
    found = drawn_around_the_best(CHART)
    weight = found.weight / found.weight.sum()
    part = CHART.standard(found.z)[:, 0]
    error = np.sqrt(np.sum(weight**2 * (part - weight @ part) ** 2))

    along = np.linspace(-6.0, 6.0, 401)
    first, second = np.meshgrid(along, along, indexing="ij")
    u = np.broadcast_to(CHART.straight(BEST), (*first.shape, SIZE)).copy()
    u[..., 0] += first
    u[..., 1] += second
    z = CHART.standard(u)
    mass = np.exp(density(z) - density(BEST))
    expected = float((mass * z[..., 0]).sum() / mass.sum())
    assert error < 0.05
    assert abs(weight @ part - expected) < 4.0 * error


class Halves(AbstractEffect):
    """An effect with the parts of a sum."""

    half: jnp.ndarray = parameter(
        "half", "h", "N", lognormal(1.0, 2.0), lognormal(3.0, 4.0), part_of="whole"
    )
    name: ClassVar[str] = "halves"
    equation: ClassVar[str] = PLUNGER
    source: ClassVar[str] = "this test"

    def __call__(self, state: State, own: tuple) -> Action:  # noqa: ARG002
        return Action()


def problem_of(*laws: Lognormal | Normal) -> Problem:
    sampled = tuple(declared(f"half[{i + 1}]", law) for i, law in enumerate(laws))
    return Problem((Halves,), Parameters(sampled, ()), (), ())


def test_sums_are_those_that_effects_tell_of():
    chart = chart_of(problem_of(Lognormal(1.0, 2.0), Lognormal(3.0, 4.0)))
    assert chart.names == ("whole", "half[2]/half[1]")
    u = chart.straight(np.zeros(2))
    np.testing.assert_allclose(u, [np.log(4.0) / np.log(2.0), np.log(3.0) / np.log(4.0)])


@pytest.mark.parametrize("other", [Normal(1.0, 0.1), Lognormal(-1.0, 2.0)])
def test_a_part_that_may_be_negative_stays_as_it_is(other):
    chart = chart_of(problem_of(Lognormal(1.0, 2.0), other))
    assert chart.names == ("half[1]", "half[2]")
    assert chart.sums == ()


def test_nothing_is_changed_where_there_is_no_sum():
    nothing = Chart(("a",), ())
    optimum = Optimum(np.zeros(1), np.zeros((1, 2)), np.eye(1), 0.0, 1, 0.0)
    assert nothing.straightened(optimum) is optimum
    assert isinstance(nothing.mode(optimum), Mode)


def test_a_sum_within_a_sum_is_straight_as_well():
    """A release tells what the branches add up to, steady running all of the friction."""
    within = PLACES[1:]

    def told(z: np.ndarray) -> np.ndarray:
        parts = np.exp(CENTRE[1:] + WIDTH[1:] * z[..., within]).sum(axis=-1)
        return np.log(np.stack([sum_of(z), parts], axis=-1))

    def known(z: np.ndarray) -> np.ndarray:
        off = (told(z) - told(BEST)) / KNOWN
        return -0.5 * np.sum(off**2, axis=-1) - 0.5 * (z**2).sum(axis=-1)

    step = 1e-6 * np.eye(SIZE)
    slopes = (told(BEST + step) - told(BEST - step)) / 2e-6 / KNOWN
    precision = np.eye(SIZE) + slopes @ slopes.T
    best = Optimum(BEST, np.zeros((1, 2)), np.linalg.inv(precision), 0.0, 1, 0.0)

    def share(chart: Chart) -> float:
        law = MixtureProposal((chart.mode(best),), np.ones(1), DOF)
        return drawn(chart.density(known), law, np.random.default_rng(4), DRAWS).even

    side_by_side = Chart(
        CHART.names, (Sum(np.roll(PLACES, -1), np.roll(CENTRE, -1), np.roll(WIDTH, -1)),)
    )
    assert share(CHART) > 0.2
    assert share(side_by_side) < 0.05
