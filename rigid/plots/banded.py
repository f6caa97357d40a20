"""A median with its bands over something, as every figure draws them."""

import numpy as np
from matplotlib.axes import Axes

from rigid.plots.shown import QUANTILES


def quantile_columns(name: str, unit: str, band: np.ndarray) -> dict[str, np.ndarray]:
    """Quantiles (5, n) as the columns of a figure's numbers: "stroke of A 5 % [m]"."""
    rows = zip(QUANTILES, band, strict=True)
    return {f"{name} {level} % [{unit}]": row for level, row in rows}


def banded(axes: Axes, x: np.ndarray, band: np.ndarray, colour: str) -> None:
    """A median with the bands that hold 50 and 90 %.

    - `band` (5, n): quantiles.
    """
    q05, q25, median, q75, q95 = band
    axes.fill_between(x, q05, q95, color=colour, alpha=0.2, linewidth=0)
    axes.fill_between(x, q25, q75, color=colour, alpha=0.38, linewidth=0)
    axes.plot(x, median, color=colour, linewidth=0.9)
