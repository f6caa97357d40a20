"""One measured run: converted to SI, checked, immutable."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from rigid.kinds import require_kind
from rigid.spec import Known, Stretch


@dataclass(frozen=True, eq=False)
class Channel:
    """What one sensor recorded.

    - quantity: `load`, `stroke`, `pressure` or `acceleration`; `position` or `force` in a motion
    - values: (n,) float64 in SI, read-only; NaN where nothing was recorded
    - valid: (n,) bool, read-only; False where a sample must not be used
    - column, unit: where it stood in the file, and in which unit
    """

    quantity: str
    values: np.ndarray
    valid: np.ndarray
    column: str
    unit: str

    def __post_init__(self):
        object.__setattr__(self, "values", locked(self.values, np.float64))
        object.__setattr__(self, "valid", locked(self.valid, np.bool_))


@dataclass(frozen=True, eq=False)
class Record:
    """One measured run.

    - time: (n,) s, strictly increasing, read-only, on the clock of the file; time stamps count
      from the first row of the file. `valve` and `release_time` use the same clock
    - channels: quantity -> Channel, without the time
    - interval: sampling interval in s: of the fitted grid where `uniform`, else the median
    - uniform: every sample lies within 1 % of an interval of time[0] + k interval, for whole k;
      gaps are allowed
    - sha256: of the file, hexadecimal
    - notes: what was dropped on reading, which defects were accepted, which units are doubted
    - corner: of a motion, the frequency in Hz up to which its force is explained
    - moving: of a run, whether the machine moves already when it begins
    """

    name: str
    kind: str
    cylinder: str
    path: Path
    sha256: str
    time: np.ndarray
    channels: Mapping[str, Channel]
    valve: tuple[Stretch, ...]
    preload: Known | None
    release_time: Known | None
    interval: float
    uniform: bool
    notes: tuple[str, ...] = ()
    corner: float | None = None
    moving: bool = False

    def __post_init__(self):
        require_kind(self.kind)
        object.__setattr__(self, "time", locked(self.time, np.float64))
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))


SAMPLES_PER_PERIOD = 20.0
"""Of the corner that a motion has where its spec states none: differences over a twentieth of a
period still tell an acceleration from noise."""


def usual_corner(interval: float) -> float:
    """Corner [Hz] of a motion sampled every `interval` seconds, where its spec states none."""
    return 1.0 / (SAMPLES_PER_PERIOD * interval)


def longest_step(corner: float) -> float:
    """Longest time between samples [s] that interpolation bridges: half a period of the corner."""
    return 0.5 / corner


def locked(values: np.ndarray, dtype: type) -> np.ndarray:
    """Return a read-only copy of `values`."""
    copy = np.array(values, dtype=dtype)
    copy.flags.writeable = False
    return copy


def grid(time: np.ndarray) -> tuple[float, bool]:
    """Return the sampling interval in s and whether all samples lie on its grid.

    - time: (n,) s, strictly increasing, at least 2 samples

    The interval is refined by least squares, so that the rounding of a logger's clock does not
    add up over a long record. Where samples leave the grid by more than 1 % of an interval, the
    interval is the median.
    """
    since = time - time[0]
    steps = np.diff(since)
    median = float(np.median(steps))
    number = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / median), 1.0))])
    interval = median
    for _ in range(3):
        interval = float(number @ since / (number @ number))
        number = np.rint(since / interval)
    on_grid = np.abs(since - number * interval) <= 0.01 * interval
    uniform = bool(np.all(on_grid) and np.all(np.diff(number) > 0))
    return (interval, True) if uniform else (median, False)
