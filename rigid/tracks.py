"""A record as the model meets it: its grid, its valve, its samples as arrays. Known before a fit."""

import dataclasses

import numpy as np

from rigid.errors import InputError
from rigid.records.record import Record
from rigid.solve.drive import Drive

NOMINAL_STROKE = {"frame": (0.0, 6e-3), "free-run": (0.0, 0.1), "field": (0.0, 0.1)}
"""Stroke range [m] where no stroke was recorded; it sets interpolation nodes, not results."""

JUMP_FRACTION = 0.2
"""A release is where the acceleration first exceeds this fraction of its greatest magnitude ..."""

QUIET_FACTOR = 6.0
"""... and this many standard deviations of the quiet stretch before it."""

QUIET_SAMPLES = 8
"""Fewest samples that make a quiet stretch."""


@dataclasses.dataclass(frozen=True)
class Track:
    """One cylinder in one record.

    - `label`: "record,cylinder"; `name`, `kind`, `cylinder`.
    - `interval` [s], `samples`: the grid. - `first` [s]: time of its first sample.
    - `data`, `weight`: by quantity, (samples,) each; weight 0 where nothing was read.
    - `drive`: of a slow record. - `tank_levels`: numbers of its flow fractions to the tank.
    - `onset`: of a release, the index of the first sample after it.
    """

    label: str
    name: str
    kind: str
    cylinder: str
    interval: float
    samples: int
    first: float
    data: dict[str, np.ndarray]
    weight: dict[str, np.ndarray]
    drive: Drive | None
    onset: int | None

    @property
    def scope(self) -> tuple[str, str, str]:
        """What a parameter that varies can vary by."""
        return self.kind, self.cylinder, self.label

    @property
    def open_levels(self) -> tuple[int, ...]:
        """Flow-fraction levels of this record: 1 is its open valve, 2 on are its tank stretches."""
        return () if self.drive is None else tuple(sorted(set(self.drive.levels) - {0}))

    @property
    def times(self) -> np.ndarray:
        """Sample times [s], shape (samples,)."""
        return self.first + self.interval * np.arange(self.samples)


def make_track(record: Record) -> Track:
    """Lay a record on its grid.

    Raises InputError where its samples are not evenly spaced.
    """
    if not record.uniform:
        raise InputError(
            f"{record.path}: samples are not evenly spaced (median interval "
            f"{record.interval:.6g} s); resample the file to an even grid before fitting"
        )
    at = np.round((record.time - record.time[0]) / record.interval).astype(int)
    samples = int(at[-1]) + 1
    data, weight = {}, {}
    for quantity, channel in record.channels.items():
        data[quantity], weight[quantity] = np.zeros(samples), np.zeros(samples)
        data[quantity][at] = np.where(channel.valid, channel.values, 0.0)
        weight[quantity][at] = channel.valid
    release = record.kind == "release"
    return Track(
        label=f"{record.name},{record.cylinder}",
        name=record.name,
        kind=record.kind,
        cylinder=record.cylinder,
        interval=record.interval,
        samples=samples,
        first=float(record.time[0]),
        data=data,
        weight=weight,
        drive=None if release else _drive(record, samples, data, weight),
        onset=_onset(record, data, weight) if release else None,
    )


def _drive(record: Record, samples: int, data: dict, weight: dict) -> Drive:
    """Read the valve programme off a record, with the stroke where the valve moves."""
    switches, levels, tanks = [], [], 1
    for stretch in record.valve:
        if stretch.position == "tank":
            tanks += 1
        levels.append({"shut": 0, "open": 1, "tank": tanks}[stretch.position])
        switches.append(stretch.until)
    first = float(record.time[0])
    if np.isfinite(switches[-1]):
        raise InputError(
            f"{record.path}: the valve programme of record '{record.name}' ends at "
            f"{switches[-1]} s; leave `until` out of its last entry"
        )
    inside = [s for s in switches[:-1] if s > first]
    skipped = len(switches) - 1 - len(inside)
    low, high = NOMINAL_STROKE[record.kind]
    strokes = [high] * len(inside)
    if "stroke" in data and weight["stroke"].any():
        seen = data["stroke"][weight["stroke"] > 0]
        low, high = min(0.0, float(seen.min())), float(seen.max())
        time = first + record.interval * np.flatnonzero(weight["stroke"])
        strokes = [float(np.interp(s, time, seen)) for s in inside]
    return Drive(
        first,
        record.interval,
        samples,
        tuple(inside),
        tuple(levels[skipped:]),
        tuple(strokes),
        (low, max(high, low + 1e-3)),
    )


def _onset(record: Record, data: dict, weight: dict) -> int:
    """Index of the first sample after the release."""
    if "acceleration" not in data:
        raise InputError(f"{record.path}: a release needs a channel 'acceleration'")
    if record.release_time is not None and record.release_time.sd == 0.0:
        return int(np.ceil((record.release_time.value - record.time[0]) / record.interval - 1e-9))
    size = np.abs(data["acceleration"] - np.median(data["acceleration"])) * weight["acceleration"]
    onset = int(np.argmax(size > JUMP_FRACTION * size.max()))
    quiet = size[:onset]
    if onset >= QUIET_SAMPLES and size[onset] < QUIET_FACTOR * quiet.std():
        raise InputError(
            f"{record.path}: no release stands out of the noise of record '{record.name}' "
            "(acceleration never clearly exceeds its quiet stretch); give `release_time`"
        )
    return onset
