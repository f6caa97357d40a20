"""Are ranks uniform? The difference of their distribution to the uniform one, with exact bands.

At each of some points the number of ranks below is binomial. The band holds the whole curve with
the stated probability: pointwise bands of one tail probability, which is chosen so that a uniform
sample stays inside all of them that often. That probability is a sum over all paths of the count,
worked out from point to point. No bins, no chi-squared.
Source: Sailynoja, Burkner and Vehtari (2022), Statistics and Computing 32, section 3.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaln, xlog1py, xlogy
from scipy.stats import binom

MOST_POINTS = 100
"""At which a curve is looked at; as many as there are ranks where these are fewer."""
SLACK = 1.0 + 1e-9
"""Two tail probabilities that differ by less are the same."""


def points(n: int) -> np.ndarray:
    """Return where the distribution of n ranks is looked at, inside (0, 1)."""
    count = min(n, MOST_POINTS)
    return np.arange(1, count) / count


def counts(ranks: np.ndarray) -> np.ndarray:
    """Number of ranks at or below each point."""
    return np.searchsorted(np.sort(ranks), points(len(ranks)), side="right")


def p_value(ranks: np.ndarray) -> float:
    """Probability that uniform ranks leave their course as far at some point, exact.

    - `ranks` (n,): in [0, 1], at least 2.
    """
    n = len(ranks)
    tails = _tails(n)
    reached = float(tails[np.arange(len(tails)), counts(ranks)].min())
    return float(np.clip(1.0 - _inside(n, tails > reached * SLACK), 0.0, 1.0))


@lru_cache(maxsize=64)
def band(n: int, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest count at each point that the band of a level still holds.

    - `n`: ranks. - `level`: probability with which a uniform sample stays inside everywhere.
    """
    tails = _tails(n)

    def excess(log_tail: float) -> float:
        return _inside(n, tails > np.exp(log_tail)) - level

    # The greatest tail that keeps the level; one probability steps between others.
    root: Any = brentq(excess, -60.0, 0.0, xtol=1e-3)
    tail = np.exp(root) / (1.0 + 2e-3)
    allowed = tails > tail
    least = allowed.argmax(axis=1)
    greatest = allowed.shape[1] - 1 - allowed[:, ::-1].argmax(axis=1)
    return least, greatest


@lru_cache(maxsize=64)
def _tails(n: int) -> np.ndarray:
    """Two-sided tail probability of every count at every point, (points, n + 1)."""
    at, k = points(n)[:, None], np.arange(n + 1)
    lower, upper = binom.cdf(k, n, at), binom.sf(k - 1, n, at)
    return np.minimum(1.0, 2.0 * np.minimum(lower, upper))


def _inside(n: int, allowed: np.ndarray) -> float:
    """Probability that the count of n uniform ranks is allowed at every point.

    - `allowed` (points, n + 1).
    """
    at = np.concatenate([[0.0], points(n)])
    before, chance = np.array([0]), np.array([1.0])
    for i, row in enumerate(allowed):
        share = (at[i + 1] - at[i]) / (1.0 - at[i])
        here = np.flatnonzero(row)
        if len(here) == 0:
            return 0.0
        chance = _binomial(here[:, None] - before, n - before, share) @ chance
        before = here
    return float(chance.sum())


def _binomial(k: np.ndarray, n: np.ndarray, share: float) -> np.ndarray:
    """Binomial probability of k (rows, columns) in n (columns,); 0 below none and above all."""
    inside = (k >= 0) & (k <= n)
    k, n = np.where(inside, k, 0), np.broadcast_to(n, k.shape)
    logs = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    return np.where(inside, np.exp(logs + xlogy(k, share) + xlog1py(n - k, -share)), 0.0)
