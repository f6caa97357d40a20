"""Uncertainty budget: five numbers of a test, and what their uncertainty is made of.

In the manner of the GUM (JCGM 100:2008, section 5.1; by simulation, JCGM 101:2008): each part's
standard uncertainty is the spread of the number when that part alone varies about the centre of the
posterior. The combined one lets all vary together, so correlations between rig and sensors count.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigid.smoothing.jumps import Jumps, at_once
from rigid.smoothing.paths import Path

FIGURES = {
    "peak load": "N",
    "load at failure": "N",
    "total impulse": "N s",
    "displacement at peak": "m",
    "effective stiffness dF/dx": "N/m",
}

PARTS = (
    "sensor noise and quantisation",
    "sensor calibration",
    "rig parameters",
    "model form",
    "the load's own movement",
)

FALL = 0.1
"""Seconds within which the greatest fall of the load counts as the failure."""

ABOUT = 0.05
"""Seconds about its instant in which the load at failure is the greatest load."""

RISE = 1.0
"""Seconds before the failure over which dF/dx is a least-squares slope."""


@dataclass(frozen=True)
class Windows:
    """Stretches of the told times, found at the posterior's centre: `failure`, `rise`."""

    failure: slice
    rise: slice


def windows(time: np.ndarray, load: np.ndarray) -> Windows:
    """Find the failure, the greatest fall within FALL, and the rise before it."""
    later = np.minimum(np.searchsorted(time, time + FALL), len(time) - 1)
    begin = int(np.argmax(load - load[later]))
    instant = begin + int(np.argmax(load[begin : later[begin] + 1]))
    around = np.searchsorted(time, [time[instant] - ABOUT, time[instant] + ABOUT])
    before = np.searchsorted(time, [time[instant] - RISE, time[instant]])
    return Windows(slice(int(around[0]), int(around[1]) + 1), slice(*(int(b) for b in before)))


class Gathered(NamedTuple):
    """What a tally holds: numbers of the draws (..., draws) over the stretches so far.

    - `peak`: load and displacement. - `failure`: greatest load there. - `impulse`.
    - `first`, `load`: time of the earliest sample, and the load there. - `about`: displacement and
      load that `sums`, of powers of what lies between, are taken about (draws, 1).
    """

    peak: np.ndarray
    failure: np.ndarray
    impulse: np.ndarray
    first: float
    load: np.ndarray
    about: np.ndarray
    sums: np.ndarray


@dataclass
class Tally:
    """The numbers of FIGURES of some draws, gathered over stretches from the last to the first.

    - `at`: where failure and rise are among all times.
    """

    at: Windows
    gathered: Gathered | None = None

    def add(
        self,
        time: np.ndarray,
        load: np.ndarray,
        displacement: np.ndarray,
        jumped: Jumps,
        first: int,
    ) -> None:
        """Take in a stretch of the paths (draws, times) that begins at place `first`.

        - `jumped`: where in it the load jumped between two samples.
        """
        great, place = at_once(load, displacement, jumped)
        rows, most = np.arange(len(load)), np.argmax(great, axis=1)
        peak = np.stack([great[rows, most], place[rows, most]])
        failure = _greatest(great[:, _within(self.at.failure, first, len(time))])
        impulse = np.trapezoid(load, time, axis=1)
        about, sums = np.stack([displacement[:, :1], load[:, :1]]), np.zeros((5, 1))
        if (old := self.gathered) is not None:
            # The first of equal peaks counts, and stretches come from the last.
            peak = np.where(peak[0] >= old.peak[0], peak, old.peak)
            failure = np.maximum(old.failure, failure)
            between = 0.5 * (old.first - time[-1]) * (load[:, -1] + old.load)
            impulse, about, sums = old.impulse + impulse + between, old.about, old.sums
        rise = _within(self.at.rise, first, len(time))
        x, f = (p[:, rise] - o for p, o in zip((displacement, load), about, strict=True))
        ones = np.ones_like(x)
        sums = sums + np.stack([p.sum(axis=1) for p in (ones, x, f, x * x, x * f)])
        earliest = load[:, 0].copy()  # a view would hold the whole stretch
        self.gathered = Gathered(peak, failure, impulse, float(time[0]), earliest, about, sums)

    def figures(self) -> np.ndarray:
        """Return the numbers of FIGURES, (draws, 5)."""
        assert self.gathered is not None  # something was added
        n, x, f, xx, xf = self.gathered.sums
        n = np.maximum(n, 1.0)
        slope = (xf - x * f / n) / np.maximum(xx - x * x / n, 1e-30)
        peak = self.gathered.peak
        return np.stack([peak[0], self.gathered.failure, self.gathered.impulse, peak[1], slope], 1)


def _within(window: slice, first: int, count: int) -> slice:
    """The part of a window that lies in `count` places from `first` on, counted from there."""
    low, high = (min(max(end - first, 0), count) for end in (window.start, window.stop))
    return slice(low, high)


def _greatest(load: np.ndarray) -> np.ndarray:
    return load.max(axis=1, initial=-np.inf)


@dataclass(frozen=True)
class Line:
    """One number of the budget.

    - `place`: cylinder, joint or "total". - `name`, `unit`. - `median`, `q05`, `q95`, `combined`:
      of all draws. - `parts`: standard uncertainties in the order of PARTS, None where nothing
      varied.
    """

    place: str
    name: str
    unit: str
    median: float
    q05: float
    q95: float
    combined: float
    parts: tuple[float | None, ...]


@dataclass(frozen=True)
class Bodies:
    """Whose load and displacement a budget is of: `place`, names of the two quantities."""

    place: str
    load: str
    displacement: str


def bodies(names: Mapping[str, Path]) -> tuple[Bodies, ...]:
    """List the places of loads, and the total, among the quantities."""
    together = Bodies("total", "load_total", "displacement_mean")
    whole = (together,) if together.displacement in names else ()
    places = (n.removeprefix("load_") for n in names if n.startswith("load_"))
    apart = (Bodies(place, f"load_{place}", f"displacement_{place}") for place in places)
    return (*(one for one in apart if one.displacement in names), *whole)


def lines(
    place: str,
    everything: tuple[np.ndarray, np.ndarray],
    parts: tuple[np.ndarray | None, ...],
    laws: np.ndarray,
) -> list[Line]:
    """Make the budget of one place.

    - `everything`: (draws, 5) and weights (draws,). - `parts`: standard uncertainties (5,) of
      noise, sensors, rig and own movement, or None. - `laws` (draws,): which law each draw is of.
    """
    values, weight = everything
    out = []
    for i, (name, unit) in enumerate(FIGURES.items()):
        order = np.argsort(values[:, i])
        share = (np.cumsum(weight[order]) - 0.5 * weight[order]) / weight.sum()
        q05, median, q95 = np.interp((0.05, 0.5, 0.95), share, values[order, i])
        mean = np.average(values[:, i], weights=weight)
        combined = np.sqrt(np.average((values[:, i] - mean) ** 2, weights=weight))
        noise, sensors, rig, own = (None if p is None else float(p[i]) for p in parts)
        form = _between(values[:, i], weight, laws)
        out.append(
            Line(place, name, unit, float(median), float(q05), float(q95), float(combined),
                 (noise, sensors, rig, form, own))
        )  # fmt: skip
    return out


def _between(values: np.ndarray, weight: np.ndarray, laws: np.ndarray) -> float | None:
    """Sd of the laws' means; None where there is one law."""
    kinds = np.unique(laws)
    if len(kinds) < 2:
        return None
    means = [np.average(values[laws == k], weights=weight[laws == k]) for k in kinds]
    shares = [weight[laws == k].sum() for k in kinds]
    mean = np.average(means, weights=shares)
    return float(np.sqrt(np.average((np.array(means) - mean) ** 2, weights=shares)))
