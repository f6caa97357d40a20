"""How often intervals hold the truth, with exact bands."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, binomtest

LEVELS = (0.5, 0.9)
"""Of the central intervals that a fit quotes."""
CONFIDENCE = 0.95
"""Of the band around a share."""
POWER = 0.9
"""Probability with which a fault is shown that is called one that would be."""


@dataclass(frozen=True)
class Coverage:
    """How often a central interval held the truth.

    - `level`: as stated. - `hits`, `n`. - `low`, `high`: Clopper-Pearson band of the share.
    - `p`: probability of a count as far from what is stated.
    """

    level: float
    hits: int
    n: int
    low: float
    high: float
    p: float

    @property
    def share(self) -> float:
        """Share of truths inside."""
        return self.hits / self.n


def coverage(ranks: np.ndarray, level: float) -> Coverage:
    """Count how often the central interval of a level held the truth.

    - `ranks` (n,): posterior probability below the truth.
    """
    inside = abs(ranks - 0.5) <= 0.5 * level
    hits, n = int(inside.sum()), len(ranks)
    tested = binomtest(hits, n, level)
    low, high = clopper_pearson(hits, n)
    return Coverage(level, hits, n, low, high, float(tested.pvalue))


def clopper_pearson(hits: int, n: int) -> tuple[float, float]:
    """Return the exact band of a rate of which n trials gave so many hits; all of it for none."""
    if not n:
        return 0.0, 1.0
    interval = binomtest(hits, n).proportion_ci(CONFIDENCE, "exact")
    return float(interval.low), float(interval.high)


def shown_from(n: int, level: float, alpha: float) -> float:
    """Greatest true coverage below `level` that n campaigns show with probability POWER.

    - `alpha`: of the two-sided test.
    """
    fewest = int(binom.ppf(alpha / 2.0, n, level)) - 1
    while fewest >= 0 and binom.cdf(fewest, n, level) > alpha / 2.0:
        fewest -= 1
    if fewest < 0:
        return 0.0
    shares = np.linspace(0.0, level, 1001)
    return float(shares[binom.cdf(fewest, n, shares) >= POWER].max(initial=0.0))
