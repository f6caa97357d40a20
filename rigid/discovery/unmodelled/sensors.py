"""Sensors that read something else than the truth: over time in each record, over their reading."""

import dataclasses
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, Bumps, Curve, together
from rigid.localfit.hidden_inputs import TIME, Abscissa
from rigid.localfit.motions import held_against, measured
from rigid.physics.sensors import UNITS

TIME_BUMPS, READING_BUMPS = 10, 6
CALLED = {"load": "load cell", "pressure": "gauge", "acceleration": "accelerometer"}
"""Sensors that are not called by their quantity."""


def distorted(quantity: str, over: Abscissa | None = None) -> About:
    """An error of a quantity's sensors; left out, it goes `over` their reading."""
    name, unit = CALLED.get(quantity, f"{quantity} sensor"), UNITS.get(quantity, "1")
    return About("sensor", f"distortion of the {name}", unit, over or Abscissa("reading", unit))


@dataclasses.dataclass(frozen=True)
class SensorError(Curve):
    """A distortion of the sensors of the quantity `kind`, over "time" or "reading"."""

    sort: ClassVar[str] = "sensor-error"
    order: ClassVar[int] = 2

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:  # noqa: ARG003
        """Bumps over the time of every channel, and over the reading of every sensor."""
        local, out = fit.local, []
        layout = local.layout
        for number, channel in enumerate(layout.channels):
            rows = (layout.channel == number) & layout.read
            target = cls(channel.quantity, TIME.name, channel.track)
            out.append(_bumped(layout.time, rows, TIME_BUMPS, target))
        read, moved = held_against(local), measured(layout)
        quantities = {channel.sensor: channel.quantity for channel in layout.channels}
        for sensor, name in enumerate(layout.problem.sensors):
            rows = (layout.sensor == sensor) & layout.read
            target = cls(quantities[name], "reading")
            own = _bumped(read, rows, READING_BUMPS, target)
            straight = rows & moved
            out.append(bent(own, read, straight) if straight.any() else own)
        return together(out)

    @property
    def about(self) -> About:
        """What it is."""
        return distorted(self.kind, TIME if self.variable == TIME.name else None)

    @property
    def wanders(self) -> bool:
        """A sensor's own time in one record."""
        return self.timed

    @property
    def forms(self) -> tuple[str, ...]:
        """A drift; in proportion to its reading it would be the gain, which every fit has."""
        return ("proportional",) if self.variable == TIME.name else ()


def _bumped(
    values: Float[np.ndarray, " n"], rows: Bool[np.ndarray, " n"], count: int, target: SensorError
) -> Bumps:
    """Bumps of a reading over some values, in some rows."""
    low, high = float(values[rows].min()), float(values[rows].max())
    width = max((high - low) / (count - 1), 1e-12)
    centres = low + width * np.arange(count)
    height = np.maximum(0.0, 1.0 - np.abs(values[:, None] - centres) / width)
    return Bumps(np.where(rows[:, None], height, 0.0), (target,) * count, centres)


def bent(bumps: Bumps, values: Float[np.ndarray, " n"], rows: Bool[np.ndarray, " n"]) -> Bumps:
    """Bumps over some values without their straight part, in some rows.

    A force, the mass that it moves and all that holds it grow together: what is in proportion to
    the reading is the gain, which no motion tells, and a zero stands in every fit.
    """
    line = np.stack([np.ones(rows.sum()), values[rows]], axis=1)
    columns = bumps.columns.copy()
    columns[rows] -= line @ np.linalg.lstsq(line, columns[rows], rcond=None)[0]
    return dataclasses.replace(bumps, columns=columns)
