"""A record as the model meets it, known before a fit: its grid, its valve, its samples."""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from rigid.io.errors import InputError
from rigid.kinds import KINDS, RecordKind, require_kind
from rigid.kinds.base import Solver
from rigid.likelihood.motion import lay
from rigid.physics.drive import Drive, require_apart, roomy
from rigid.physics.inverse import Along
from rigid.physics.strap import REACH
from rigid.records.record import Record

JUMP_FRACTION = 0.2
"""A release is where the acceleration first exceeds this fraction of its greatest magnitude ..."""

QUIET_FACTOR = 6.0
"""... and this many standard deviations of the quiet stretch before it."""

NORMAL_MEDIAN = 0.6745
"""Median of the magnitude of a standard normal variable."""

QUIET_SAMPLES = 8
"""Fewest samples that make a quiet stretch."""


MOST_SWITCHES = 8
"""Switches of a record's valve, at most; each costs step matrices of its own."""

QUIET_LEAD = REACH
"""Samples kept before a release: those in which a strap may be letting go, enough to show the
quiet, and the same in every record, so that releases share one program."""

ROUND_TO = 64
"""Releases are padded to a multiple of this many samples, for the same reason."""


@dataclasses.dataclass(frozen=True)
class Series:
    """What was read: `data` and `weight` by quantity; weight 0 where nothing was."""

    data: dict[str, Float[np.ndarray, " samples"]]
    weight: dict[str, Float[np.ndarray, " samples"]]

    @property
    def samples(self) -> int:
        """Samples of each quantity."""
        return len(next(iter(self.data.values())))

    def has(self, quantity: str) -> bool:
        """Whether anything was read of a quantity."""
        return quantity in self.weight and bool(self.weight[quantity].any())

    def padded(
        self, quantity: str, samples: int
    ) -> tuple[Float[np.ndarray, " {samples}"], Float[np.ndarray, " {samples}"]]:
        """Data and weight of a quantity, followed by zeros up to `samples`."""
        room = (0, samples - len(self.data[quantity]))
        return np.pad(self.data[quantity], room), np.pad(self.weight[quantity], room)

    def cut(self, first: int, samples: int) -> "Series":
        """Return `samples` samples from `first` on; zeros where there are none."""

        def window(series: np.ndarray) -> np.ndarray:
            out = np.zeros(samples)
            begin = max(first, 0)
            piece = series[begin : first + samples]
            out[begin - first : begin - first + len(piece)] = piece
            return out

        return Series(
            {q: window(s) for q, s in self.data.items()},
            {q: window(s) for q, s in self.weight.items()},
        )


class Given(eqx.Module):
    """What was done at a joint of a machine in a run, as it was recorded.

    - `command` (samples,) [-]: of the valve; `force` (samples,) [N]: on the body ahead; None where
      there was none. - `moving`: whether the machine moved when the run began.
    """

    command: Array | None
    force: Array | None
    moving: bool = eqx.field(static=True)


class Track(eqx.Module):
    """One cylinder in one record, without what was read.

    - `label`: "record,cylinder"; `name`, `kind`, `cylinder`.
    - `interval` [s], `samples`: of the record; `size`: samples of the grid that it is simulated on;
      `first` [s]: time of its first sample.
    - `drive`: of a slow record.
    - `onset`: of a release, the index of the first sample after it; `onset_time` [s].
    - `along`: of a motion, what was measured of it. - `given`: of a run, what was done.
    """

    label: str = eqx.field(static=True)
    name: str = eqx.field(static=True)
    kind: str = eqx.field(static=True)
    cylinder: str = eqx.field(static=True)
    interval: float = eqx.field(static=True)
    samples: Array = eqx.field(converter=jnp.asarray)
    size: int = eqx.field(static=True)
    drive: Drive | None
    onset: int | None = eqx.field(static=True)
    first: Array = eqx.field(converter=jnp.asarray)
    along: Along | None = None
    given: Given | None = None

    def __check_init__(self):
        require_kind(self.kind)

    @property
    def of(self) -> type[RecordKind]:
        """What the record's kind says of itself."""
        return KINDS[self.kind]

    def on_grid(self, size: int) -> "Track":
        """Return the same record on a grid of so many samples, at least its own."""
        drive = None if self.drive is None else dataclasses.replace(self.drive, size=size)
        return dataclasses.replace(self, size=size, drive=drive)

    @property
    def scope(self) -> tuple[str, str, str]:
        """What a parameter that varies can vary by."""
        return self.kind, self.cylinder, self.label

    @property
    def open_levels(self) -> tuple[int, ...]:
        """Flow-fraction levels of this record: 1 is its open valve, 2 on are its tank stretches."""
        return () if self.drive is None else tuple(sorted(set(self.drive.levels) - {0}))

    @property
    def times(self) -> Float[np.ndarray, " samples"]:
        """Sample times [s]."""
        return float(self.first) + self.interval * np.arange(int(self.samples))

    @property
    def onset_time(self) -> Array:
        """Time of the first sample after a release [s]."""
        assert self.onset is not None  # a release has one
        return self.first + self.interval * self.onset


class Laid(NamedTuple):
    """A record on its grid: what is known of it before a fit, and what was read."""

    track: Track
    series: Series


def make_track(record: Record) -> Laid:
    """Lay a record on its grid.

    Raises InputError where its samples are not evenly spaced or do not fit its valve programme,
    or, of a motion, its corner.
    """
    return LAY[KINDS[record.kind].solver](record)


def _track(record: Record, interval: float, samples: int, first: float, **more) -> Track:
    """Return the track of a record; `more` is what only some solvers need."""
    given = {"drive": None, "onset": None, "size": samples} | more
    label = f"{record.name},{record.cylinder}"
    return Track(
        label=label,
        name=record.name,
        kind=record.kind,
        cylinder=record.cylinder,
        interval=interval,
        samples=samples,
        first=first,
        **given,
    )


def _even(record: Record) -> tuple[Record, Series]:
    """Return an evenly sampled record with its interval rounded, and its samples, gaps and all."""
    if not record.uniform:
        raise InputError(
            f"{record.path}: samples are not evenly spaced (median interval "
            f"{record.interval:.6g} s); resample the file to an even grid before fitting"
        )
    # Rounded, so that records of one logger share a program whatever their last bits.
    record = dataclasses.replace(record, interval=float(f"{record.interval:.9g}"))
    at = np.round((record.time - record.time[0]) / record.interval).astype(int)
    data, weight = {}, {}
    for quantity, channel in record.channels.items():
        data[quantity], weight[quantity] = np.zeros(at[-1] + 1), np.zeros(at[-1] + 1)
        data[quantity][at] = np.where(channel.valid, channel.values, 0.0)
        weight[quantity][at] = channel.valid
    return record, Series(data, weight)


def _slow(record: Record) -> Laid:
    """Lay a record with a valve programme."""
    record, series = _even(record)
    drive = _drive(record, series.samples)
    first = float(record.time[0])
    track = _track(record, record.interval, series.samples, first, drive=drive, size=drive.size)
    return Laid(track, series)


def _drive(record: Record, samples: int) -> Drive:
    """Read the valve programme off a record."""
    switches, levels, tanks = [], [], 1
    for stretch in record.valve:
        if stretch.position == "tank":
            tanks += 1
        levels.append({"shut": 0, "open": 1, "tank": tanks}[stretch.position])
        switches.append(stretch.until)
    first = float(record.time[0])
    inside = [s for s in switches[:-1] if s > first]
    if len(inside) > MOST_SWITCHES:
        raise InputError(
            f"{record.path}: record '{record.name}' has {len(inside)} switches of the valve; "
            f"at most {MOST_SWITCHES} are supported, split the record"
        )
    skipped = len(switches) - 1 - len(inside)
    levels = tuple(levels[skipped:])
    drive = Drive(first, record.interval, samples, tuple(inside), levels, roomy(samples))
    require_apart(drive)
    return drive


def _release(record: Record) -> Laid:
    """Lay a release, cut to a fixed lead before its onset."""
    record, series = _even(record)
    onset = _onset(record, series)
    length = -(-(QUIET_LEAD + series.samples - onset) // ROUND_TO) * ROUND_TO
    first = float(record.time[0]) + (onset - QUIET_LEAD) * record.interval
    track = _track(record, record.interval, length, first, onset=QUIET_LEAD)
    return Laid(track, series.cut(onset - QUIET_LEAD, length))


def _motion(record: Record) -> Laid:
    """Lay a measured motion: what is explained is its force."""
    laid = lay(record)
    track = _track(record, laid.interval, len(laid.force), laid.first, along=laid.along)
    return Laid(track, Series({"force": laid.force}, {"force": laid.weight}))


DONE = ("command", "force")
"""Channels of a run that say what was done; they are not explained."""


def _run(record: Record) -> Laid:
    """Lay a run of a machine: what was done at a joint, and what its sensors read."""
    record, series = _even(record)
    done: dict[str, Array | None] = dict.fromkeys(DONE)
    for quantity in DONE:
        if quantity not in series.data:
            continue
        if not series.weight[quantity].all():
            raise InputError(
                f"{record.path}: record '{record.name}', {quantity}: samples are missing; what was "
                "done to a machine must be known throughout, cut the record with `rows`"
            )
        done[quantity] = jnp.asarray(series.data[quantity])
    read = Series(
        {q: s for q, s in series.data.items() if q not in DONE},
        {q: s for q, s in series.weight.items() if q not in DONE},
    )
    drive = _drive(record, read.samples)
    track = _track(
        record,
        record.interval,
        read.samples,
        float(record.time[0]),
        drive=drive,
        size=drive.size,
        given=Given(done["command"], done["force"], record.moving),
    )
    return Laid(track, read)


LAY: dict[Solver, Callable[[Record], Laid]] = {
    "slow": _slow,
    "release": _release,
    "motion": _motion,
    "machine": _run,
}


def _onset(record: Record, series: Series) -> int:
    """Index of the first sample after the release."""
    if not series.has("acceleration"):
        raise InputError(f"{record.path}: a release needs a channel 'acceleration'")
    if record.release_time is not None and record.release_time.sd == 0.0:
        return int(np.ceil((record.release_time.value - record.time[0]) / record.interval - 1e-9))
    data, weight = series.data["acceleration"], series.weight["acceleration"]
    size = np.abs(data - np.median(data[weight > 0])) * weight
    onset = int(np.argmax(size > JUMP_FRACTION * size.max()))
    rest = size[weight > 0] if onset < QUIET_SAMPLES else size[:onset]
    # Most of a release's record is ring-down and rest: its median tells the noise all the same.
    noise = np.median(rest) / NORMAL_MEDIAN if onset < QUIET_SAMPLES else rest.std()
    if size[onset] < QUIET_FACTOR * noise:
        raise InputError(
            f"{record.path}: no release stands out of the noise of record '{record.name}' "
            "(acceleration never clearly exceeds its quiet stretch); give `release_time`"
        )
    return onset
