"""The law over the modes, fitted to weighted draws of it."""

import numpy as np
import pytest
from scipy import stats

from rigid.inference.adaptation import EVEN, LEAST_FAR, Weighted, adapted, drawn, fitted
from rigid.inference.proposal import MixtureProposal, Mode, kish

SIZE, DRAWS, DOF = 12, 8192, 16.0


START = MixtureProposal((Mode(np.zeros(SIZE), np.eye(SIZE), 0.0),), np.ones(1), 8.0)


def weighed(mean: np.ndarray, width: np.ndarray) -> Weighted:
    """Draws of the law weighed for a Gaussian of other place and widths."""

    def target(z: np.ndarray) -> np.ndarray:
        return -0.5 * (((z - mean) / width) ** 2).sum(axis=1)

    return drawn(target, START, np.random.default_rng(0), DRAWS)


def test_a_law_too_narrow_along_one_axis_is_stretched_there_alone():
    mean, width = np.zeros(SIZE), np.ones(SIZE)
    mean[0], width[0] = 0.5, 1.5
    found = weighed(mean, width)
    (got,) = fitted(START, found, DOF).modes
    # Variances of a covariance of n draws: 2 / n; of a mean: 1 / n. Five standard errors.
    size = kish(found.weight)
    covariance = got.covariance_factor @ got.covariance_factor.T
    assert abs(covariance[0, 0] / width[0] ** 2 - 1.0) < 5.0 * np.sqrt(2.0 / size)
    assert abs(got.mean[0] - mean[0]) < 5.0 * width[0] / np.sqrt(size)
    beside = covariance[1:, 1:] - np.eye(SIZE - 1)
    assert np.abs(beside).max() < 0.02  # what the stretched axis, not quite the first, takes along


def test_few_draws_change_nothing():
    found = weighed(np.ones(SIZE), np.ones(SIZE))
    few = Weighted(found.z[:SIZE], found.log_prob[:SIZE], found.log_weight[:SIZE])
    assert fitted(START, few, DOF).modes == START.modes


def test_a_posterior_without_a_number_changes_nothing():
    found = drawn(lambda z: np.full(len(z), np.nan), START, np.random.default_rng(0), DRAWS)
    assert fitted(START, found, DOF) is START


def test_two_modes_are_weighed_and_each_is_moved():
    centres = np.zeros((2, SIZE))
    centres[:, 0] = -8.0, 8.0
    modes = tuple(Mode(centre, np.eye(SIZE), 0.0) for centre in centres)
    law = MixtureProposal(modes, np.ones(2) / 2.0, 8.0)
    moved = centres + 0.5

    def target(z: np.ndarray) -> np.ndarray:
        first, second = (-0.5 * ((z - m) ** 2).sum(axis=1) for m in moved)
        return np.logaddexp(first, second + np.log(3.0))

    got = fitted(law, drawn(target, law, np.random.default_rng(1), DRAWS), DOF)
    np.testing.assert_allclose(got.weights, [0.25, 0.75], atol=0.03)
    for mode, mean in zip(got.modes, moved, strict=True):
        np.testing.assert_allclose(mode.mean, mean, atol=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_a_law_too_narrow_for_one_round_is_fitted_in_several(seed: int):
    """One draw of the first in a hundred counts; half as wide as the posterior on three axes."""
    mean, width = np.zeros(SIZE), np.ones(SIZE)
    mean[0], width[:3] = 0.8, 2.2

    def target(z: np.ndarray) -> np.ndarray:
        return -0.5 * (((z - mean) / width) ** 2).sum(axis=1)

    rng = np.random.default_rng(seed)
    found = drawn(target, START, rng, 512)
    assert found.even < EVEN
    once = drawn(target, fitted(START, found, DOF), rng, DRAWS).even
    often = drawn(target, adapted(target, START, rng, 512, DOF), rng, DRAWS).even
    assert often > max(EVEN, 2.0 * once)


def test_two_rounds_are_enough_where_the_law_fits():
    """The second tries what the first one fitted."""
    asked = []

    def target(z: np.ndarray) -> np.ndarray:
        asked.append(len(z))
        return -0.5 * (z**2).sum(axis=1)

    adapted(target, START, np.random.default_rng(3), DRAWS, DOF)
    assert asked == [DRAWS, DRAWS]


SHOULDER, PEAK = 0.15, 0.2
"""Share of the posterior in a shoulder as wide as the prior, and sd of the peak on it."""


def on_a_shoulder(z: np.ndarray) -> np.ndarray:
    peak, shoulder = (-0.5 * (z[:, 0] / w) ** 2 - np.log(w) for w in (PEAK, 1.0))
    first = np.logaddexp(np.log(1.0 - SHOULDER) + peak, np.log(SHOULDER) + shoulder)
    return first - 0.5 * (z[:, 1:] ** 2).sum(axis=1)


@pytest.mark.parametrize("far", [True, False])
def test_a_shoulder_is_covered_by_a_law_that_goes_far_and_by_no_other(far: bool):
    """The curvature tells the peak alone, and weights of its own draws look even."""
    own = np.eye(SIZE)
    own[0, 0] = PEAK
    modes = (Mode(np.zeros(SIZE), own, 0.0),)
    wider = (Mode(np.zeros(SIZE), np.eye(SIZE), 0.0),) if far else ()
    weights = np.array([0.8, 0.2] if far else [1.0])
    first = MixtureProposal(modes, weights, 8.0, wider)
    rng = np.random.default_rng(5)
    law = adapted(on_a_shoulder, first, rng, 2048, DOF)
    found = drawn(on_a_shoulder, law, rng, DRAWS)
    assert found.even > EVEN
    outside = np.abs(found.z[:, 0]) > 4.0 * PEAK
    share = found.weight[outside].sum() / found.weight.sum()
    true = SHOULDER * 2.0 * stats.norm.sf(4.0 * PEAK)
    error = np.sqrt(true / kish(found.weight))
    assert (abs(share - true) < 4.0 * error) == far


def test_a_wider_law_is_never_given_up():
    wider = (Mode(np.zeros(SIZE), 3.0 * np.eye(SIZE), 0.0),)
    first = MixtureProposal(START.modes, np.array([0.8, 0.2]), 8.0, wider)
    found = drawn(lambda z: -0.5 * (z**2).sum(axis=1), first, np.random.default_rng(0), DRAWS)
    weights = fitted(first, found, DOF).weights
    assert weights[1] == pytest.approx(LEAST_FAR * weights[0])
