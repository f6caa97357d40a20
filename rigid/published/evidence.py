"""Evidence and posterior by weighted points: quasi-random ones of the prior, then adapted ones.

A story has some ten numbers and costs an eigenvalue problem. Points of the prior (scrambled Sobol
sets) find where the likelihood is; a mixture of Gaussians is fitted to what they weigh, for each of
the questions that will be asked alike, tempered where too few points count; points drawn from it
improve it, round after round; and the last points are drawn from that mixture and, for one in five,
from the prior itself, which bounds every weight. Nothing moves by small steps: where a posterior
has several modes each gets its share. The last points come in independent blocks; the scatter
between blocks is the Monte Carlo error.

Sources: Cappe, Douc, Guillin, Marin and Robert 2008, Stat. Comput. 18, 447 (mixtures fitted to
weighted points); Hesterberg 1995, Technometrics 37(2) (defensive mixtures); Fraley and Raftery
2007, J. Classif. 24, 155 (expectation and maximisation with covariances held by a prior).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, ndtri
from scipy.stats import qmc

from rigid.inference.proposal import kish

BLOCKS = 16
SIZE = 2048
"""Of one block of last points, a power of two."""

FIRST = 2**15
ROUND = 2**14
MOST_ROUNDS = 12
"""Points of the prior, points of a round, and how many rounds at most."""

PARTS, SWEEPS, LEARNED = 6, 20, 2048
"""Gaussians for each question, sweeps of their fit, and points that it sees."""

FIRM, NARROW, WIDER = 10.0, 0.3, 1.1
"""A Gaussian's covariance is held by d + FIRM points that scatter with NARROW of the overall
covariance, and is then made WIDER, since too narrow a proposal costs more than too wide a one."""

DEFENSIVE = 0.2
ENOUGH = 150.0
"""Effective points that a fit needs; a likelihood is tempered until it leaves as many."""

PLENTY = 500.0
"""Effective points of every question that end the rounds."""

JITTER = 0.02
"""By which points that were picked twice come apart, in prior standard deviations."""


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


class Mixtures(NamedTuple):
    """A mixture of Gaussians for each question.

    - `shares` (questions, k). - `centres` (questions, k, d).
    - `factors` (questions, k, d, d): lower Cholesky factors.
    """

    shares: Float[np.ndarray, "questions k"]
    centres: Float[np.ndarray, "questions k d"]
    factors: Float[np.ndarray, "questions k d d"]


Questions = Callable[[np.ndarray], np.ndarray]
"""Points (n, d) to log-likelihoods (questions, n)."""


def prior_points(dimension: int, seed: int, size: int) -> Float[np.ndarray, "n d"]:
    """Standard normal points: a scrambled Sobol set of `size`, a power of two."""
    engine = qmc.Sobol(dimension, scramble=True, rng=np.random.default_rng(seed))
    tiny = 0.5**40
    return ndtri(np.clip(engine.random_base2(int(np.log2(size))), tiny, 1.0 - tiny))


def adapted(questions: Questions, dimension: int, seed: int) -> Points:
    """Points that serve all questions, `BLOCKS` independent blocks one after the other."""
    rng = np.random.default_rng([seed, 1])
    z = prior_points(dimension, seed, FIRST)
    cloud = Points(z, np.zeros(len(z)))
    for _ in range(MOST_ROUNDS):
        answers = questions(cloud.z)
        mixtures = laid(cloud, answers, rng)
        if min(effective(a + cloud.log_ratio) for a in answers) >= PLENTY:
            break
        cloud = drawn(mixtures, ROUND, rng)
    return drawn(mixtures, BLOCKS * SIZE, rng)


def effective(log_weight: Float[np.ndarray, " n"]) -> float:
    """Effective number of weighted points, (sum w)^2 / sum w^2."""
    return kish(np.exp(log_weight - np.max(log_weight)))


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


def laid(cloud: Points, answers: np.ndarray, rng: np.random.Generator) -> Mixtures:
    """Fit a mixture to the points as each question (questions, n) weighs them."""
    found = []
    for answer in answers:
        weight = answer * tempered(answer, cloud.log_ratio) + cloud.log_ratio
        picked = cloud.z[resampled(weight, LEARNED, rng)]
        found.append(fitted(picked + JITTER * rng.standard_normal(picked.shape), rng))
    return Mixtures(*(np.stack(parts) for parts in zip(*found, strict=True)))


def fitted(z: Float[np.ndarray, "n d"], rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Shares, centres and Cholesky factors of Gaussians fitted to points."""
    n, d = z.shape
    held = (d + FIRM) * NARROW * (np.cov(z.T).reshape(d, d) + JITTER**2 * np.eye(d))
    shares, centres = np.full(PARTS, 1.0 / PARTS), z[rng.choice(n, PARTS, replace=False)]
    factors = np.linalg.cholesky(np.tile(held / (d + FIRM), (PARTS, 1, 1)))
    for _ in range(SWEEPS):
        heights = np.log(shares)[:, None] + _heights(centres, factors, z)
        member = np.exp(heights - logsumexp(heights, axis=0))
        count = member.sum(axis=1)
        shares = np.maximum(count / n, 1e-3)
        shares = shares / shares.sum()
        centres = member @ z / np.maximum(count, 1e-9)[:, None]
        off = z - centres[:, None]
        scatter = np.swapaxes(member[..., None] * off, 1, 2) @ off
        covariance = (scatter + held) / (count + d + FIRM)[:, None, None]
        factors = np.linalg.cholesky(WIDER * covariance)
    return shares, centres, factors


def drawn(mixtures: Mixtures, count: int, rng: np.random.Generator) -> Points:
    """Draw points from the mixtures and, for a share `DEFENSIVE`, from the prior."""
    questions, parts, d = mixtures.centres.shape
    weights = (mixtures.shares / questions).ravel()
    centres, factors = mixtures.centres.reshape(-1, d), mixtures.factors.reshape(-1, d, d)
    z = rng.standard_normal((count, d))
    part = rng.choice(questions * parts, size=count, p=weights)
    moved = centres[part] + np.einsum("nij,nj->ni", factors[part], z)
    z = np.where(rng.random(count)[:, None] < DEFENSIVE, z, moved)
    prior = -0.5 * np.sum(z**2, axis=1)
    heights = _heights(centres, factors, z) + np.log(weights)[:, None]
    mixed = logsumexp(heights, axis=0) + np.log1p(-DEFENSIVE)
    return Points(z, prior - np.logaddexp(mixed, prior + np.log(DEFENSIVE)))


def _heights(centres: np.ndarray, factors: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Log densities (k, n) at z (n, d) of Gaussians, but for (2 pi)^(d/2)."""
    out = np.empty((len(centres), len(z)))
    for row, centre, factor in zip(out, centres, factors, strict=True):
        white = (z - centre) @ np.linalg.inv(factor).T
        row[:] = -0.5 * np.sum(white**2, axis=1) - np.log(np.diagonal(factor)).sum()
    return out


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
