"""Fewer points for the same picture: what a long record looks like at the width of a page."""

import numpy as np
from jaxtyping import Float, Int

# Columns a panel has on paper; more points than four a column cannot be told apart.
COLUMNS = 160


def line_points(values: Float[np.ndarray, " n"]) -> Int[np.ndarray, " kept"]:
    """Indices of first, lowest, highest and last value in each column, in order.

    Source: Jugel et al. (2014), M4, Proc. VLDB 7(10): such a line is drawn without error.
    """
    n = values.size
    if n <= 4 * COLUMNS:
        return np.arange(n)
    kept = []
    for block in np.array_split(np.arange(n), COLUMNS):
        part, known = values[block], np.isfinite(values[block])
        lowest, highest = np.where(known, part, np.inf), np.where(known, part, -np.inf)
        kept += [block[0], block[lowest.argmin()], block[highest.argmax()], block[-1]]
    return np.unique(kept)


def band_points(
    time: Float[np.ndarray, " n"], low: Float[np.ndarray, " n"], high: Float[np.ndarray, " n"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A band with a point a column that covers all of the band given: (time, low, high)."""
    n = time.size
    if n <= 2 * COLUMNS:
        return time, low, high
    starts = np.linspace(0, n, 2 * COLUMNS, endpoint=False).astype(int)
    lows, highs = np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)
    ends = np.append(starts, n - 1)
    return time[ends], np.append(lows, low[-1]), np.append(highs, high[-1])
