"""Where within a sampling interval a load that jumped has jumped.

The smoother spreads the variance of a jump evenly over the steps of its interval. Each step so has
the right covariance; but a path drawn from it goes up and down between two samples by as much as
the load jumped, and its greatest value means nothing. A load that gives way does so at one instant:
it is what it was until then, and what it is after. Paths of which a greatest value is asked are
therefore made so within such intervals: on with the slope of the interval before, and from one
instant on what the next sample has. The instant is that at which the impulse stays what it was,
since that is what the machine's masses have felt.
"""

from typing import NamedTuple

import numpy as np


class Jumps(NamedTuple):
    """Intervals among told times in which a load jumped.

    - `begin`, `end`: places of the samples before and after each among all told times. - `risen`:
      place of the sample before `begin` where the load did not jump between them, else `begin`.
    """

    begin: np.ndarray
    end: np.ndarray
    risen: np.ndarray

    def within(self, where: slice) -> "Jumps":
        """Return those of a stretch of the told times, counted from its first."""
        here = (self.begin >= where.start) & (self.end < where.stop)
        first = where.start
        risen = np.where(self.risen < first, self.begin, self.risen)
        return Jumps(self.begin[here] - first, self.end[here] - first, risen[here] - first)


def jumps(rows: np.ndarray, jumped: np.ndarray, steps: int) -> Jumps:
    """Find the intervals in which a load jumped.

    - `rows` (times,): steps since the first sample that are told; all of an interval that jumped.
    - `jumped` (samples,): whether the load did so from each sample to the next.
    """
    samples = np.flatnonzero(jumped[:-1])
    begin, end = (np.searchsorted(rows, (samples + after) * steps) for after in (0, 1))
    calm = (samples > 0) & ~jumped[np.maximum(samples - 1, 0)]
    risen = np.where(calm, np.searchsorted(rows, (samples - 1) * steps), begin)
    told = end < len(rows)
    return Jumps(begin[told], end[told], risen[told])


def at_once(
    load: np.ndarray, displacement: np.ndarray, where: Jumps
) -> tuple[np.ndarray, np.ndarray]:
    """Return paths (draws, times) that jump at one instant within each interval that jumped.

    The displacement goes on as before until then, and is left as it was from then on.
    """
    loads, places = load.copy(), displacement.copy()
    for begin, end, risen in zip(*(each.tolist() for each in where), strict=True):
        steps, step = end - begin, np.arange(1, end - begin)
        first, last = load[:, [begin]], load[:, [end]]
        lost = np.where(first == last, 1.0, first - last)
        above = np.trapezoid(load[:, begin : end + 1] - last, axis=1)[:, None]
        before = step <= np.clip(above / lost, 0.0, steps)
        inside = slice(begin + 1, end)
        loads[:, inside] = np.where(before, _on(load, begin, risen, steps), last)
        places[:, inside] = np.where(
            before, _on(displacement, begin, risen, steps), displacement[:, inside]
        )
    return loads, places


def _on(path: np.ndarray, begin: int, risen: int, steps: int) -> np.ndarray:
    """The steps of an interval if the path went on as it did in the one before."""
    first = path[:, [begin]]
    return first + (first - path[:, [risen]]) / steps * np.arange(1, steps)
