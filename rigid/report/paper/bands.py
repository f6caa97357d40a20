"""What the figures of simulations share: converter steps, and a line with its band."""

import numpy as np
from matplotlib.axes import Axes

from rigid.plots.figure import Columns
from rigid.published.walk.solving import Trajectory


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """Values as a converter of this step reads them."""
    return np.round(values / step) * step


def line(axes: Axes, time: np.ndarray, band: np.ndarray, colour: str, label: str) -> None:
    """A line with its 90 % band; `band` (3, n): value, 5 %, 95 %."""
    axes.fill_between(time, band[1], band[2], color=colour, alpha=0.25, linewidth=0)
    axes.plot(time, band[0], color=colour, label=label)


def band_of(found: Columns, name: str, unit: str, value: str = "") -> np.ndarray:
    """Value, 5 % and 95 % (3, n) of what `columns` laid out; `value`: what the first is called."""
    return np.stack([found[f"{name}{part} [{unit}]"] for part in (value, ", 5 %", ", 95 %")])


def columns(name: str, unit: str, run: Trajectory, quantity: str) -> dict[str, np.ndarray]:
    """A quantity with its band as columns of a file."""
    value, low, high = run.band(quantity)
    return {
        f"{name} [{unit}]": value,
        f"{name}, 5 % [{unit}]": low,
        f"{name}, 95 % [{unit}]": high,
    }
