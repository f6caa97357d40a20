"""How often intervals hold the truth: of one quantity with exact bands, of all together."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binom, binomtest, norm, t

LEVELS = (0.5, 0.9)
"""Of the central intervals that a fit quotes."""
CONFIDENCE = 0.95
"""Of the band around a share."""
FEWEST_TOGETHER = 15
"""Campaigns from which on the spread of their shares is known well enough for a test. Drawn anew
from 42 sound campaigns of the shipped calibration, a limit of 0.0025 is broken by chance 1.6, 0.4
and 1.0 times as often as it says by 15, 30 and 100, and 20 times as often by 8."""
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


@dataclass(frozen=True)
class Held:
    """What intervals of all quantities hold together, and what the slopes at the truths foretell.

    Quantities of one campaign miss together, since they hang on each other: the mean share of a
    campaign is one number, and its spread from campaign to campaign says how well the mean is
    known. A study of some dozen campaigns owes much of it to their chance, which the slopes at the
    truths tell without any fit: the difference of the two is known better, and is the fit's own.

    - `name`: of the campaigns. - `level`: of the intervals. - `n`: campaigns.
    - `share`, `error`: mean share of quantities inside, its standard error.
    - `foretold`: the same of parameters alone, by slopes; `apart`, `apart_error`: share of
      parameters less foretold. - `p`: of differences as far from 0, by chance;
      `adjusted`: corrected for the number of tests.
    """

    name: str
    level: float
    n: int
    share: float
    error: float
    foretold: float
    apart: float
    apart_error: float
    p: float
    adjusted: float = 1.0

    @property
    def says(self) -> str:
        """What was found, in a sentence."""
        off = self.level + self.apart
        return (
            f"{100 * self.level:.0f} % intervals of all quantities hold {100 * self.share:.1f} ± "
            f"{100 * self.error:.1f} % of truths; with the chance of these campaigns taken off "
            f"{100 * off:.1f} ± {100 * self.apart_error:.1f} %"
        )


def held(
    name: str, values: Sequence[Mapping[str, Any]], quantities: Sequence[str], level: float
) -> Held | None:
    """Count over all quantities; None for too few campaigns, or rows without slopes.

    - `values`: of rows. - `quantities`: names of what counts.
    """
    if len(values) < FEWEST_TOGETHER or any("foretold" not in v for v in values):
        return None
    wide = float(norm.ppf(0.5 + 0.5 * level))
    every = np.array([_inside(v["ranks"], quantities, level) for v in values])
    own = np.array([_inside(v["ranks"], v["foretold"], level) for v in values])
    told = np.array([np.mean(np.abs([*v["foretold"].values()]) < wide) for v in values])
    apart = own - told
    spread = float(apart.std(ddof=1) / np.sqrt(len(values)))
    off = abs(float(apart.mean())) / spread if spread > 0.0 else 0.0
    return Held(
        name=name,
        level=level,
        n=len(values),
        share=float(every.mean()),
        error=float(every.std(ddof=1) / np.sqrt(len(values))),
        foretold=float(told.mean()),
        apart=float(apart.mean()),
        apart_error=spread,
        p=float(2.0 * t.sf(off, len(values) - 1)),
    )


def _inside(ranks: Mapping[str, float], names: Iterable[str], level: float) -> float:
    """Share of some quantities whose truth is in the central interval of a level."""
    found = np.array([ranks[name] for name in names if name in ranks])
    return float(np.mean(np.abs(found - 0.5) <= 0.5 * level))
