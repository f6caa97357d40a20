"""Whether a quantity that was estimated in several campaigns stays what it is."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, norm

LEAST_FOR_TREND, LEAST_FOR_SCATTER = 3, 2
"""Campaigns that a trend and a scatter take."""
ALPHA = 0.01
"""Chance that any quantity of a season is said to change where none does."""
SDS_IN_90_PERCENT = 3.2897072539029444
"""Width of the central 90 % of the standard normal."""

STEADY, DRIFTS, DIFFERS = "steady", "drifts", "differs"


class Drift(NamedTuple):
    """What several estimates of one quantity say of its constancy.

    - `logarithmic`: whether it is taken as a logarithm, `mean` being the exponential of that's.
    - `mean`: weighted; `error`: its sd, relative where logarithmic.
    - `slope`, `slope_error`: a campaign, on that scale; None for fewer than three.
    - `trend_p`, `scatter_p`: chances of a slope and of a scatter as large where it is constant.
    """

    logarithmic: bool
    mean: float
    error: float
    slope: float | None
    slope_error: float | None
    trend_p: float | None
    scatter_p: float | None

    def verdict(self, tests: int) -> str:
        """What is said of it where so many tests were made: STEADY, DRIFTS or DIFFERS.

        - `tests`: of the season; each may give a false alarm (Bonferroni).
        """
        if self.trend_p is not None and self.trend_p < ALPHA / tests:
            return DRIFTS
        if self.scatter_p is not None and self.scatter_p < ALPHA / tests:
            return DIFFERS
        return STEADY

    @property
    def tests(self) -> int:
        """Number of tests made of it."""
        return sum(p is not None for p in (self.trend_p, self.scatter_p))


def drift(
    median: Float[np.ndarray, " campaigns"],
    q05: Float[np.ndarray, " campaigns"],
    q95: Float[np.ndarray, " campaigns"],
    when: Float[np.ndarray, " campaigns"],
) -> Drift | None:
    """Test estimates for a trend and for scatter beyond their uncertainties; None without any.

    - `median`, `q05`, `q95`: of each campaign; all positive ones are compared as logarithms.
    - `when`: number of the campaign in its season.

    Estimates are taken as independent and normal. What uncertainty they share, through the same
    priors of the rig, makes the tests say too little, not too much.

    Source: weighted least squares; Cochran (1954), Biometrics 10, 101, for the scatter.
    """
    spread = (q95 - q05) / SDS_IN_90_PERCENT
    keep = np.isfinite(median) & np.isfinite(spread) & (spread > 0.0)
    if not keep.any():
        return None
    median, q05, q95, when, spread = (a[keep] for a in (median, q05, q95, when, spread))
    logarithmic = bool((q05 > 0.0).all())
    if logarithmic:
        median, spread = np.log(median), np.log(q95 / q05) / SDS_IN_90_PERCENT
    weight = spread**-2
    mean, count = float(np.average(median, weights=weight)), len(median)
    slope = slope_error = trend_p = scatter_p = None
    if count >= LEAST_FOR_SCATTER:
        scatter_p = float(chi2.sf(weight @ (median - mean) ** 2, count - 1))
    if count >= LEAST_FOR_TREND:
        centred = when - np.average(when, weights=weight)
        size = float(weight @ centred**2)
        slope = float(weight @ (centred * median)) / size
        slope_error = size**-0.5
        trend_p = float(2.0 * norm.sf(abs(slope) / slope_error))
    centre = float(np.exp(mean)) if logarithmic else mean
    error = float(weight.sum() ** -0.5)
    return Drift(logarithmic, centre, error, slope, slope_error, trend_p, scatter_p)
