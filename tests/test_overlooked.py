"""What a law overlooks is seen by points that it did not draw."""

import numpy as np
import pytest
from test_nested import HELD, LEVEL, density, expansion, optimum

from rigid.inference.coordinates import Chart
from rigid.inference.newton import Expansion
from rigid.inference.overlooked import around, overlooked
from rigid.inference.proposal import MixtureProposal, Mode, kish, mode_weights
from rigid.inference.ridge import Ridge, bend_of
from rigid.inference.search import Optimum

CHART = Chart(("a", "b", "c"), (), ())
THIN = 0.01


def straight(z: np.ndarray) -> np.ndarray:
    """A flat sheet: the first number is told by its prior alone."""
    return -0.5 * (z[..., 0] ** 2 + (z[..., 1] / THIN) ** 2 + (z[..., 2] / LEVEL) ** 2)


def flat(z: np.ndarray, others: np.ndarray) -> Expansion:
    assert not others.size
    known = np.diag([1.0, THIN**-2, 0.0])
    return Expansion(float(0.5 * z @ known @ z), known @ z, known)


def flat_optimum() -> Optimum:
    covariance = np.diag([1.0, THIN**2, LEVEL**2])
    return Optimum(np.zeros(3), np.zeros((0, 2)), covariance, 0.0, 1, 0.0)


def share(log_prob, ridge: Ridge, widths: tuple[float, float, float]) -> float:
    """What a law of such widths around the optimum overlooks."""
    law = MixtureProposal((Mode(np.zeros(3), np.diag(widths), 0.0),), np.ones(1), 16.0)
    weights = mode_weights(log_prob, law, np.random.default_rng(1), 2048)
    return overlooked(log_prob, law, weights.greatest, ridge, np.random.default_rng(2))


@pytest.fixture(scope="module")
def ridge() -> Ridge:
    return Ridge(CHART, CHART, bend_of(flat, flat_optimum(), HELD, 0.1).followed)


def test_points_around_conditional_modes_are_weighed_right(ridge):
    """Along a straight ridge all else is Gaussian: what is uneven is how w was tried alone."""
    assert ridge.followed is not None
    u, log_density = around(ridge.followed, np.random.default_rng(3))
    weight = np.exp(straight(u) - log_density)
    own = weight.reshape(len(ridge.followed.modes), -1)
    np.testing.assert_allclose(own, np.broadcast_to(own[:, :1], own.shape), rtol=1e-9)
    weight /= weight.sum()
    error = 4.0 / np.sqrt(kish(weight))
    assert weight @ u[:, 0] == pytest.approx(0.0, abs=error)
    assert weight @ u[:, 0] ** 2 == pytest.approx(1.0, abs=error * np.sqrt(2.0))


def test_a_law_that_covers_overlooks_nothing_and_a_narrow_one_is_seen(ridge):
    assert share(straight, ridge, (1.0, THIN, LEVEL)) < 0.02
    # 2048 draws of a law of 0.3 sds reach some 1.2: a fifth to a fourth lies beyond.
    assert 0.1 < share(straight, ridge, (0.3, THIN, LEVEL)) < 0.5


def test_a_ridge_that_the_law_leaves_is_seen():
    followed = bend_of(expansion, optimum(), HELD, 0.1).followed
    assert share(density, Ridge(CHART, CHART, followed), (1.0, THIN, LEVEL)) > 0.5


def test_without_conditional_modes_nothing_is_said():
    assert share(straight, Ridge(CHART, CHART, None), (0.3, THIN, LEVEL)) == 0.0
