"""Laws with known answers, for the tests of the sampler."""

import numpy as np
from scipy import stats
from scipy.special import logsumexp

from rigid.inference.proposal import MixtureProposal, Mode


def gaussian(d=3):
    """A correlated Gaussian: log-probability, a proposal wider and off centre, truth."""
    factor = np.tril(np.random.default_rng(3).normal(size=(d, d)) * 0.5, -1) + np.eye(d)
    mean = np.arange(d) - 1.0
    covariance = factor @ factor.T
    inverse = np.linalg.inv(covariance)

    def log_prob(z):
        away = z - mean
        return -0.5 * np.einsum("ni,ij,nj->n", away, inverse, away)

    mode = Mode(mean + 0.3, 1.2 * factor, 0.0)
    return log_prob, MixtureProposal((mode,), np.ones(1)), mean, covariance


def two_modes(d=5, share=0.8, apart=8.0):
    """A mixture of two Gaussians with known shares: log-probability and its modes."""
    rng = np.random.default_rng(7)
    factors = [np.tril(rng.normal(size=(d, d)) * 0.2) + np.eye(d) * s for s in (1.0, 0.5)]
    factors = [np.tril(f) * np.sign(np.diag(f)) for f in factors]
    means = [np.zeros(d), np.full(d, apart)]
    laws = [stats.multivariate_normal(m, f @ f.T) for m, f in zip(means, factors, strict=True)]
    logs = np.log([share, 1.0 - share])

    def log_prob(z):
        return logsumexp([law.logpdf(z) + a for law, a in zip(laws, logs, strict=True)], axis=0)

    modes = tuple(Mode(m, f, float(log_prob(m[None]))) for m, f in zip(means, factors, strict=True))
    return log_prob, modes
