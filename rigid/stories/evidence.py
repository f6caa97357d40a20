"""Evidence and posterior by weighted points: quasi-random ones of the prior, then adapted ones.

A story has some ten numbers and costs an eigenvalue problem. Points of the prior (scrambled Sobol
sets) find where the likelihood is; a mixture of Gaussian kernels is laid over what they weigh,
tempered at first, for all questions that will be asked alike; and the last points are drawn from
that mixture and, for one in five, from the prior itself, which bounds every weight. Nothing moves
by small steps: where a posterior has several modes each gets its share. The last points come in
independent blocks; the scatter between blocks is the Monte Carlo error.

Sources: Cappe, Guillin, Marin and Robert 2004, J. Comput. Graph. Stat. 13(4) (population Monte
Carlo); Hesterberg 1995, Technometrics 37(2) (defensive mixtures).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, ndtri
from scipy.stats import qmc

BLOCKS = 16
SIZE = 1024
"""Of one block of last points, a power of two."""

FIRST = 4096
MOST_ROUNDS = 12
KERNELS = 64
"""For each question."""

DEFENSIVE = 0.2
ENOUGH = 150.0
"""Effective points that kernels are laid over; a likelihood is tempered until it leaves as many."""

LEAST_SPREAD = 0.05
"""Of a kernel, in prior standard deviations; the narrowest law here is that of k_LC, about 0.15."""


class Evidence(NamedTuple):
    """A mean likelihood over the prior.

    - `log`: of it. - `error`: Monte Carlo standard error of `log`.
    - `effective`: number of points that count, (sum w)^2 / sum w^2.
    """

    log: float
    error: float
    effective: float


class Points(NamedTuple):
    """Points and what makes them speak for the prior.

    - `z` (n, d): standard normal a priori. - `log_ratio` (n,): prior over the law they come from.
    """

    z: Float[np.ndarray, "n d"]
    log_ratio: Float[np.ndarray, " n"]


class Kernels(NamedTuple):
    """A mixture of Gaussians alike in weight, those of one question alike in shape.

    - `centres` (questions, k, d). - `factors` (questions, d, d): lower Cholesky factors.
    """

    centres: Float[np.ndarray, "questions k d"]
    factors: Float[np.ndarray, "questions d d"]


Questions = Callable[[np.ndarray], np.ndarray]
"""Points (n, d) to log-likelihoods (questions, n)."""


def prior_points(dimension: int, seed: int, size: int = FIRST) -> Float[np.ndarray, "n d"]:
    """Standard normal points: a scrambled Sobol set."""
    engine = qmc.Sobol(dimension, scramble=True, rng=np.random.default_rng(seed))
    tiny = 0.5**40
    return ndtri(np.clip(engine.random_base2(int(np.log2(size))), tiny, 1.0 - tiny))


def adapted(questions: Questions, dimension: int, seed: int) -> Points:
    """Points that serve all questions, `BLOCKS` independent blocks one after the other."""
    rng = np.random.default_rng([seed, 1])
    z = prior_points(dimension, seed)
    cloud = Points(z, np.zeros(len(z)))
    for _ in range(MOST_ROUNDS):
        answers = questions(cloud.z)
        weights = [answer * tempered(answer, cloud.log_ratio) for answer in answers]
        done = all(np.array_equal(w, a) for w, a in zip(weights, answers, strict=True))
        kernels = laid(cloud, np.stack(weights) + cloud.log_ratio, rng)
        if done:
            break
        cloud = drawn(kernels, FIRST, rng)
    return drawn(kernels, BLOCKS * SIZE, rng)


def effective(log_weight: Float[np.ndarray, " n"]) -> float:
    """Effective number of weighted points, (sum w)^2 / sum w^2."""
    return float(np.exp(2.0 * logsumexp(log_weight) - logsumexp(2.0 * log_weight)))


def tempered(answer: np.ndarray, log_ratio: np.ndarray) -> float:
    """The greatest power up to 1 of a likelihood that leaves `ENOUGH` effective points."""
    if effective(answer + log_ratio) >= ENOUGH:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        enough = effective(middle * answer + log_ratio) >= ENOUGH
        low, high = (middle, high) if enough else (low, middle)
    return low


def laid(cloud: Points, log_weights: np.ndarray, rng: np.random.Generator) -> Kernels:
    """Lay kernels over the points as each question weighs them (questions, n)."""
    d = cloud.z.shape[1]
    width = (4.0 / (KERNELS * (d + 2.0))) ** (1.0 / (d + 4.0))  # Silverman 1986, eq. (4.14)
    centres, factors = [], []
    for weight in log_weights:
        centres.append(cloud.z[resampled(weight, KERNELS, rng)])
        share = np.exp(weight - logsumexp(weight))
        off = cloud.z - share @ cloud.z
        spread = (off * share[:, None]).T @ off
        factors.append(np.linalg.cholesky(width**2 * spread + LEAST_SPREAD**2 * np.eye(d)))
    return Kernels(np.stack(centres), np.stack(factors))


def drawn(kernels: Kernels, count: int, rng: np.random.Generator) -> Points:
    """Draw points from the kernels and, for a share `DEFENSIVE`, from the prior."""
    questions, k, d = kernels.centres.shape
    z = rng.standard_normal((count, d))
    which, centre = rng.integers(questions, size=count), rng.integers(k, size=count)
    moved = kernels.centres[which, centre] + np.einsum("nij,nj->ni", kernels.factors[which], z)
    z = np.where(rng.random(count)[:, None] < DEFENSIVE, z, moved)
    prior = -0.5 * np.sum(z**2, axis=1)
    parts = [_height(c, f, z) for c, f in zip(kernels.centres, kernels.factors, strict=True)]
    mixed = logsumexp(np.stack(parts), axis=0) + np.log1p(-DEFENSIVE) - np.log(questions)
    return Points(z, prior - np.logaddexp(mixed, prior + np.log(DEFENSIVE)))


def _height(centres: np.ndarray, factor: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Log density at z (n, d) of Gaussians about centres (k, d), but for (2 pi)^(d/2)."""
    inverse = np.linalg.inv(factor)
    white, around = z @ inverse.T, centres @ inverse.T
    squares = np.sum(white**2, axis=1)[:, None] - 2.0 * white @ around.T + np.sum(around**2, axis=1)
    height = -np.log(len(centres)) - np.log(np.diagonal(factor)).sum()
    return logsumexp(-0.5 * np.maximum(squares, 0.0), axis=1) + height


def evidence(log_weight: Float[np.ndarray, " n"], blocks: int = BLOCKS) -> Evidence:
    """Mean weight of equal blocks of points, one after the other.

    - `log_weight`: log-likelihood plus the points' `log_ratio`.
    """
    parts = log_weight.reshape(blocks, -1)
    each = logsumexp(parts, axis=1) - np.log(parts.shape[1])
    total = float(logsumexp(each) - np.log(blocks))
    relative = np.exp(each - total)
    error = float(relative.std(ddof=1) / np.sqrt(blocks))
    return Evidence(total, error, effective(log_weight))


def ratio_error(first: Evidence, second: Evidence) -> float:
    """Standard error of the log of the ratio of two evidences."""
    return float(np.hypot(first.error, second.error))


def resampled(
    log_weight: Float[np.ndarray, " n"], count: int, rng: np.random.Generator
) -> np.ndarray:
    """Indices (count,) of points drawn in proportion to their weights, systematically.

    Source: Kitagawa 1996, J. Comput. Graph. Stat. 5(1), 14 (systematic resampling).
    """
    weight = np.exp(log_weight - log_weight.max())
    edges = np.cumsum(weight) / weight.sum()
    marks = (rng.random() + np.arange(count)) / count
    return rng.permutation(np.minimum(np.searchsorted(edges, marks), len(weight) - 1))


def weighted_quantile(
    values: Float[np.ndarray, " n"], log_weight: Float[np.ndarray, " n"], shares: tuple[float, ...]
) -> np.ndarray:
    """Quantiles of weighted points."""
    order = np.argsort(values)
    weight = np.exp(log_weight[order] - log_weight.max())
    middle = (np.cumsum(weight) - 0.5 * weight) / weight.sum()
    return np.interp(shares, middle, values[order])
