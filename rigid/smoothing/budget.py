"""Uncertainty budget: five numbers of a test, and what their uncertainty is made of.

In the manner of the GUM (JCGM 100:2008, section 5.1; by simulation, JCGM 101:2008): each part's
standard uncertainty is the spread of the number when that part alone varies about the centre of the
posterior. The combined one lets all vary together, so correlations between rig and sensors count.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

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


def figures(
    time: np.ndarray, load: np.ndarray, displacement: np.ndarray, at: Windows
) -> np.ndarray:
    """The numbers of FIGURES for paths (draws, times); gives (draws, 5)."""
    rows = np.arange(len(load))
    peak = np.argmax(load, axis=1)
    x, f = displacement[:, at.rise], load[:, at.rise]
    off = x - x.mean(axis=1, keepdims=True)
    slope = np.sum(off * f, axis=1) / np.maximum(np.sum(off**2, axis=1), 1e-30)
    return np.stack(
        [
            load[rows, peak],
            load[:, at.failure].max(axis=1),
            np.trapezoid(load, time, axis=1),
            displacement[rows, peak],
            slope,
        ],
        axis=1,
    )


@dataclass(frozen=True)
class Line:
    """One number of the budget.

    - `place`: cylinder or "total". - `name`, `unit`. - `median`, `q05`, `q95`, `combined`: of all
      draws; `parts`: standard uncertainties in the order of PARTS, None where nothing varied.
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
    """List cylinders and the total among the quantities."""
    out = [
        Bodies(n.removeprefix("load_"), n, n.replace("load", "displacement"))
        for n in names
        if n.startswith("load_") and n != "load_total"
    ]
    if "load_total" in names:
        out.append(Bodies("total", "load_total", "displacement_mean"))
    return tuple(out)


def lines(
    place: str,
    everything: tuple[np.ndarray, np.ndarray],
    parts: tuple[np.ndarray | None, ...],
    laws: np.ndarray,
) -> list[Line]:
    """Make the budget of one place.

    - `everything`: (draws, 5) and weights (draws,). - `parts`: (draws, 5) of noise, sensors, rig
      and own movement, or None. - `laws` (draws,): which law each draw is of.
    """
    values, weight = everything
    out = []
    for i, (name, unit) in enumerate(FIGURES.items()):
        order = np.argsort(values[:, i])
        share = (np.cumsum(weight[order]) - 0.5 * weight[order]) / weight.sum()
        q05, median, q95 = np.interp((0.05, 0.5, 0.95), share, values[order, i])
        mean = np.average(values[:, i], weights=weight)
        combined = np.sqrt(np.average((values[:, i] - mean) ** 2, weights=weight))
        noise, sensors, rig, own = (None if p is None else float(np.std(p[:, i])) for p in parts)
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
