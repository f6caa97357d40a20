"""Weighted draws of a posterior, from a law that is fitted to the first of them."""

from typing import NamedTuple

import numpy as np

from rigid.problem import Problem, log_density
from rigid.proposal import MixtureProposal, Mode, pareto_shape

ESS = 500.0
BATCH, MOST_DRAWS = 2048, 6_144
FIRST_DOF, DOF = 8.0, 12.0
"""Of the law around the modes, whose width is not known well, and of the fitted one."""
RELIABLE = 0.7
"""Pareto shape of weights below which their sums are reliable: Vehtari et al. (2024), section 3."""
LEAST = 1e-3
"""Weight of a mode, so that none is never drawn."""


class Drawn(NamedTuple):
    """Draws of the posterior (n, size), their weights (n,), and whether they can be trusted."""

    z: np.ndarray
    weight: np.ndarray
    good: bool


def laid_over(
    problem: Problem, modes: tuple[Mode, ...], rng: np.random.Generator
) -> MixtureProposal:
    """Fit a law to weighted draws of that around the modes, which do not count further.

    Along k_frame the posterior can be twice as wide as the law around the best fit, and its tails
    would hang on few draws.
    """
    law = MixtureProposal(modes, np.ones(len(modes)) / len(modes), FIRST_DOF)
    return fitted(law, *_drawn(problem, law, rng))


def weighted(problem: Problem, law: MixtureProposal, rng: np.random.Generator) -> Drawn:
    """Draw of a law until the weights are worth ESS independent draws, and reliable."""
    draws, logs = [], []
    while True:
        z, log_weight = _drawn(problem, law, rng)
        draws.append(z)
        logs.append(log_weight)
        every = np.concatenate(logs)
        weight = np.exp(every - every.max())
        good = kish(weight) >= ESS and pareto_shape(weight) < RELIABLE
        if good or len(weight) >= MOST_DRAWS:
            return Drawn(np.concatenate(draws), weight, good)


def _drawn(
    problem: Problem, law: MixtureProposal, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    z = law.sample(rng, BATCH)
    return z, log_density(problem, z) - law.log_density(z)


def kish(weight: np.ndarray) -> float:
    """How many independent draws weights (n,) are worth."""
    return float(weight.sum() ** 2 / (weight**2).sum())


def fitted(law: MixtureProposal, z: np.ndarray, log_weight: np.ndarray) -> MixtureProposal:
    """Move and stretch a law to what weighted draws say, along the axes they do say it of.

    - `z` (n, d): drawn from it. - `log_weight` (n,).
    """
    weight = np.exp(log_weight - log_weight.max())
    shares = law.responsibilities(z) * weight[:, None]
    modes = tuple(_moved(m, z, s) for m, s in zip(law.modes, shares.T, strict=True))
    return MixtureProposal(modes, np.maximum(shares.sum(axis=0) / weight.sum(), LEAST), DOF)


def _moved(mode: Mode, z: np.ndarray, weight: np.ndarray) -> Mode:
    """One mode's law made to fit.

    In its own units the draws have the identity as covariance where it is right, and eigenvalues
    between (1 - sqrt(d/n))^2 and (1 + sqrt(d/n))^2 from chance alone (Marchenko and Pastur 1967),
    n effective draws: only axes beyond these are changed.
    """
    size, d = kish(weight), z.shape[1]
    if size < d:
        return mode
    weight = weight / weight.sum()
    own = np.linalg.solve(mode.covariance_factor, (z - mode.mean).T).T
    centre = weight @ own
    covariance = (own * weight[:, None]).T @ own - np.outer(centre, centre)
    width, axes = np.linalg.eigh(covariance)
    by_chance = abs(np.sqrt(np.maximum(width, 0.0)) - 1.0) <= np.sqrt(d / size)
    width = np.where(by_chance, 1.0, width)
    factor = mode.covariance_factor @ (axes * np.sqrt(width))
    mean = mode.mean + mode.covariance_factor @ centre
    stretched = np.asarray(np.linalg.cholesky(factor @ factor.T), dtype=np.float64)
    return Mode(mean, stretched, mode.log_posterior)
