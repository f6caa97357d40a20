"""The law that weighted draws of the coverage study come from."""

import numpy as np
from importance import fitted, kish

from rigid.proposal import MixtureProposal, Mode

SIZE, DRAWS = 12, 8192


def weighed(mode: Mode, mean: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Draws of a mode's law with log weights for a Gaussian of other place and widths."""
    law = MixtureProposal((mode,), np.ones(1), 8.0)
    z = law.sample(np.random.default_rng(0), DRAWS)
    log_target = -0.5 * (((z - mean) / width) ** 2).sum(axis=1)
    return z, log_target - law.log_density(z)


def test_a_law_too_narrow_along_one_axis_is_stretched_there_alone():
    mean, width = np.zeros(SIZE), np.ones(SIZE)
    mean[0], width[0] = 0.5, 1.5
    start = Mode(np.zeros(SIZE), np.eye(SIZE), 0.0)
    first = weighed(start, mean, width)
    got = fitted(start, first)
    # Variances of a covariance of n draws: 2 / n; of a mean: 1 / n. Five standard errors.
    size = kish(np.exp(first[1] - first[1].max()))
    covariance = got.covariance_factor @ got.covariance_factor.T
    assert abs(covariance[0, 0] / width[0] ** 2 - 1.0) < 5.0 * np.sqrt(2.0 / size)
    assert abs(got.mean[0] - mean[0]) < 5.0 * width[0] / np.sqrt(size)
    beside = covariance[1:, 1:] - np.eye(SIZE - 1)
    assert np.abs(beside).max() < 0.02  # what the stretched axis, not quite the first, takes along


def test_few_draws_change_nothing():
    start = Mode(np.zeros(SIZE), np.eye(SIZE), 0.0)
    z, log_weight = weighed(start, np.ones(SIZE), np.ones(SIZE))
    assert fitted(start, (z[:60], log_weight[:60])) is start
