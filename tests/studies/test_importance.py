"""The law that weighted draws of the coverage study come from."""

import numpy as np
from importance import fitted, kish

from rigid.proposal import MixtureProposal, Mode

SIZE, DRAWS = 12, 8192


START = MixtureProposal((Mode(np.zeros(SIZE), np.eye(SIZE), 0.0),), np.ones(1), 8.0)


def weighed(mean: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Draws of the law with log weights for a Gaussian of other place and widths."""
    z = START.sample(np.random.default_rng(0), DRAWS)
    log_target = -0.5 * (((z - mean) / width) ** 2).sum(axis=1)
    return z, log_target - START.log_density(z)


def test_a_law_too_narrow_along_one_axis_is_stretched_there_alone():
    mean, width = np.zeros(SIZE), np.ones(SIZE)
    mean[0], width[0] = 0.5, 1.5
    z, log_weight = weighed(mean, width)
    (got,) = fitted(START, z, log_weight).modes
    # Variances of a covariance of n draws: 2 / n; of a mean: 1 / n. Five standard errors.
    size = kish(np.exp(log_weight - log_weight.max()))
    covariance = got.covariance_factor @ got.covariance_factor.T
    assert abs(covariance[0, 0] / width[0] ** 2 - 1.0) < 5.0 * np.sqrt(2.0 / size)
    assert abs(got.mean[0] - mean[0]) < 5.0 * width[0] / np.sqrt(size)
    beside = covariance[1:, 1:] - np.eye(SIZE - 1)
    assert np.abs(beside).max() < 0.02  # what the stretched axis, not quite the first, takes along


def test_few_draws_change_nothing():
    z, log_weight = weighed(np.ones(SIZE), np.ones(SIZE))
    assert fitted(START, z[:12], log_weight[:12]).modes == START.modes


def test_two_modes_are_weighed_and_each_is_moved():
    centres = np.zeros((2, SIZE))
    centres[:, 0] = -8.0, 8.0
    modes = tuple(Mode(centre, np.eye(SIZE), 0.0) for centre in centres)
    law = MixtureProposal(modes, np.ones(2) / 2.0, 8.0)
    z = law.sample(np.random.default_rng(1), DRAWS)
    moved = centres + 0.5
    each = [-0.5 * ((z - m) ** 2).sum(axis=1) for m in moved]
    got = fitted(law, z, np.logaddexp(each[0], each[1] + np.log(3.0)) - law.log_density(z))
    np.testing.assert_allclose(got.weights, [0.25, 0.75], atol=0.03)
    for mode, mean in zip(got.modes, moved, strict=True):
        np.testing.assert_allclose(mode.mean, mean, atol=0.15)
