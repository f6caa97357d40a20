"""Draws at conditional modes of their own, along a ridge that winds more than a polynomial can."""

import dataclasses

import numpy as np
import pytest

from rigid.inference.adaptation import Weighted, drawn
from rigid.inference.coordinates import Chart
from rigid.inference.nested import Nested, nested_about
from rigid.inference.newton import Expansion
from rigid.inference.proposal import MixtureProposal, kish, pareto_shape
from rigid.inference.ridge import bend_of
from rigid.inference.search import Optimum

THICK, LEVEL, WINDS = 0.01, 0.3, 4.0
HELD = np.array([False, False, True])
DRAWS = 1500


def sheet(a: np.ndarray) -> np.ndarray:
    return 1.0 - np.cos(WINDS * a)


def density(z: np.ndarray) -> np.ndarray:
    """A sheet that winds with the first number; the third is a noise level, told to LEVEL."""
    off = (z[..., 1] - sheet(z[..., 0])) / THICK
    return -0.5 * (off**2 + z[..., 0] ** 2 + z[..., 1] ** 2 + (z[..., 2] / LEVEL) ** 2)


def expansion(z: np.ndarray, others: np.ndarray) -> Expansion:
    assert not others.size
    off = (z[1] - sheet(z[0])) / THICK
    slope = np.array([-WINDS * np.sin(WINDS * z[0]), 1.0, 0.0]) / THICK
    own = np.diag([1.0, 1.0, 0.0])
    value = 0.5 * (off**2 + z[0] ** 2 + z[1] ** 2)
    return Expansion(value, slope * off + own @ z, np.outer(slope, slope) + own)


def optimum() -> Optimum:
    known = expansion(np.zeros(3), np.empty(0)).information + np.diag([0.0, 0.0, LEVEL**-2])
    return Optimum(np.zeros(3), np.zeros((0, 2)), np.linalg.inv(known), 0.0, 1, 0.0)


def law(local=expansion) -> Nested:
    found = nested_about(local, optimum(), HELD, np.random.default_rng(1))
    assert found is not None
    return found


@pytest.fixture(scope="module")
def draws() -> Weighted:
    return law().drawn(density, np.random.default_rng(2), DRAWS)


def exact(of) -> float:
    """Mean of what hangs on the first number, the sheet taken for thin: its width is 1 %."""
    a = np.linspace(-6.0, 6.0, 60_001)
    weight = np.exp(-0.5 * (a**2 + sheet(a) ** 2))
    return float(weight @ of(a) / weight.sum())


def test_no_polynomial_covers_the_sheet_and_modes_of_their_own_do(draws: Weighted):
    bend = bend_of(expansion, optimum(), HELD, 0.1).bend
    chart = Chart(("a", "b", "c"), (), (bend,) if bend else ())
    one = MixtureProposal((chart.mode(optimum()),), np.ones(1), 16.0)
    by_chart = drawn(chart.density(density), one, np.random.default_rng(3), DRAWS)
    assert by_chart.even < 0.1
    assert draws.even > 0.5
    assert pareto_shape(draws.weight) < 0.7


def test_weighted_draws_have_the_posterior_s_means(draws: Weighted):
    weight = draws.weight / draws.weight.sum()
    error = 4.0 / np.sqrt(kish(draws.weight))  # of a mean, in sds of what is averaged
    a, b, level = draws.z.T
    for name, found, want, sd in (
        ("a^2", a**2, exact(lambda x: x**2), 1.2),
        ("a beyond 1", a > 1.0, exact(lambda x: x > 1.0), 0.4),
        ("b", b, exact(sheet), 0.65),
        ("b^2", b**2, exact(lambda x: sheet(x) ** 2), 1.5),
        ("c^2", level**2, LEVEL**2, np.sqrt(2.0) * LEVEL**2),
    ):
        assert weight @ found == pytest.approx(want, abs=error * sd), name
    off = (b - sheet(a)) / THICK
    assert weight @ off**2 == pytest.approx(1.0, abs=error * np.sqrt(2.0))


@pytest.mark.slow
def test_the_volume_around_each_mode_counts():
    """A sheet e times thicker with every unit of the first number, whose mean is 0 all the same."""

    def thicker(z: np.ndarray) -> np.ndarray:
        thick = THICK * np.exp(z[..., 0])
        off = (z[..., 1] - sheet(z[..., 0])) / thick
        return -0.5 * (off**2 + z[..., 0] ** 2 + (z[..., 2] / LEVEL) ** 2) - np.log(thick)

    def local(z: np.ndarray, others: np.ndarray) -> Expansion:
        assert not others.size
        thick = THICK * np.exp(z[0])
        slope = np.array([-WINDS * np.sin(WINDS * z[0]), 1.0, 0.0]) / thick
        off = (z[1] - sheet(z[0])) / thick
        value = 0.5 * (off**2 + z[0] ** 2) + np.log(thick)
        own = np.diag([1.0, 0.0, 0.0])
        return Expansion(value, slope * off + own @ z, np.outer(slope, slope) + own)

    found = law(local).drawn(thicker, np.random.default_rng(4), DRAWS)
    error = 4.0 / np.sqrt(kish(found.weight))
    first = found.z[:, 0]
    assert found.weight @ first / found.weight.sum() == pytest.approx(0.0, abs=error)
    forgotten = found.weight * np.exp(-first)  # what weights without the volume would be
    assert abs(forgotten @ first / forgotten.sum()) > 5.0 * error


@pytest.mark.parametrize(
    ("place", "share", "sliced"),
    [
        ((1.5, float(sheet(np.array(1.5))), 0.0), 0.4, True),  # on the sheet, two winds on
        ((1.5, float(sheet(np.array(1.5))) + 0.5, 0.0), 0.4, False),  # off it
        ((1.5, float(sheet(np.array(1.5))) + 0.5, 0.0), 0.001, True),  # and next to nothing
    ],
)
def test_other_optima_are_drawn_along_the_same_ridge_or_not_at_all(place, share, sliced):
    others = [(np.array(place), share)]
    found = nested_about(expansion, optimum(), HELD, np.random.default_rng(1), others)
    assert (found is not None) == sliced


def test_nothing_is_sliced_where_all_is_told():
    told = dataclasses.replace(optimum(), covariance=np.eye(3) * 1e-6)
    assert nested_about(expansion, told, HELD, np.random.default_rng(1)) is None
