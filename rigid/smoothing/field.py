"""A field record as the smoother meets it: one cylinder's readings, blocks, a rough path."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy.ndimage import gaussian_filter1d

from rigid.io.errors import InputError
from rigid.kinds import kinds_with
from rigid.likelihood.tracks import make_track
from rigid.records.read import read_records
from rigid.records.record import Record
from rigid.smoothing.model import QUANTITIES, Reference
from rigid.spec import Spec

BLOCK = 512
"""Samples in one compiled stretch."""

NODE = 16
"""Samples between two nodes: in 0.16 s the oil column changes by 1 % at most."""

ROUGH_SPAN = 8.0
"""Samples over which the rough path is smoothed."""

AT_REST = 1
"""Samples at the start that must read a rig at rest; the valve may be open from then on."""

MOST_OFF = 6.0
"""Standard deviations of noise and zero beyond which the start is not at rest."""


@dataclasses.dataclass(frozen=True, eq=False)
class Field:
    """One cylinder in one field record.

    - `name`, `cylinder`, `kind`; `sha256` of its file. - `first`, `interval` [s].
    - `reading` (samples, 3) SI, `known` (samples, 3): 1 or 0, load, stroke and pressure.
    """

    name: str
    cylinder: str
    sha256: str
    first: float
    interval: float
    reading: np.ndarray
    known: np.ndarray
    kind: str = "field"

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.reading)

    @property
    def blocks(self) -> int:
        """Number of blocks, the last one padded."""
        return -(-self.samples // BLOCK)

    @property
    def label(self) -> str:
        """Name and cylinder, as in results."""
        return f"{self.name},{self.cylinder}"

    def without(self, aside: np.ndarray) -> "Field":
        """Return the record in which some readings (samples, 3) are not known."""
        return dataclasses.replace(self, known=np.where(aside, 0.0, self.known))

    def cut(self, first: int, last: int) -> "Field":
        """Return the samples from `first` to before `last`."""
        return dataclasses.replace(
            self,
            first=self.first + first * self.interval,
            reading=self.reading[first:last],
            known=self.known[first:last],
        )


def make_field(record: Record, spread: Mapping[str, float]) -> Field:
    """Lay a field record on its grid.

    - `spread`: of each quantity, the sd of noise and zero together [SI].

    Raises InputError where a channel is missing, samples are not evenly spaced, or the record does
    not begin out of load.
    """
    missing = [q for q in QUANTITIES if q not in record.channels]
    if missing:
        raise InputError(
            f"{record.path}: field record '{record.name}', cylinder {record.cylinder}, has no "
            f"channel {' and no '.join(missing)}; bands need load, stroke and pressure"
        )
    track, series = make_track(record)
    reading = np.stack([series.data[q] for q in QUANTITIES], axis=1)
    known = np.stack([series.weight[q] for q in QUANTITIES], axis=1)
    for i, quantity in enumerate(QUANTITIES):
        begin = reading[:AT_REST, i][known[:AT_REST, i] > 0]
        if begin.size and abs(np.median(begin)) > MOST_OFF * spread[quantity]:
            raise InputError(
                f"{record.path}: field record '{record.name}', cylinder {record.cylinder}, begins "
                f"with a {quantity} of {np.median(begin):.4g} (SI); it must begin at rest and out "
                "of load, cut with `rows` where it does"
            )
    return Field(
        name=record.name,
        cylinder=record.cylinder,
        sha256=record.sha256,
        first=float(track.first),
        interval=record.interval,
        reading=reading,
        known=known,
        kind=record.kind,
    )


def reference(field: Field) -> Reference:
    """Return the rough path of a record at its nodes, one more than whole blocks hold."""
    index = np.arange(field.samples)
    smooth = []
    for i in (1, 2):
        read = field.known[:, i] > 0
        values = np.interp(index, index[read], field.reading[read, i])
        smooth.append(gaussian_filter1d(values, ROUGH_SPAN, mode="nearest"))
    speed = np.gradient(smooth[0], field.interval)
    nodes = np.arange(field.blocks * BLOCK // NODE + 1) * NODE
    at = [np.interp(nodes, index, path) for path in (smooth[0], speed, smooth[1])]
    return Reference(*at)


def liveliest(field: Field, blocks: int) -> slice:
    """Samples of the `blocks` blocks in which the load's readings change most often."""
    if field.blocks <= blocks:
        return slice(0, field.samples)
    changed = np.diff(field.reading[:, 0], prepend=0.0) != 0.0
    count = np.add.reduceat(changed.astype(int), np.arange(0, field.samples, BLOCK))
    first = int(np.argmax(np.convolve(count, np.ones(blocks, dtype=int), "valid"))) * BLOCK
    return slice(first, min(first + blocks * BLOCK, field.samples))


def node_places() -> np.ndarray:
    """Place of every sample of a block on the way from the node before it to the next."""
    return (np.arange(BLOCK) % NODE) / NODE


def read_fields(spec: Spec) -> tuple[tuple[Field, ...], ...]:
    """Read a spec's field records: for each run its cylinders, in the order of the spec.

    Raises InputError with the problems of all records, or where there are none, or where the
    cylinders of a run do not share their sample times.
    """
    spread = {
        q: float(np.hypot(spec.sensors[q].noise + spec.sensors[q].step, spec.sensors[q].zero_sd))
        for q in QUANTITIES
    }
    runs: dict[str, list[Field]] = {}
    problems = []
    for record in read_records(spec, kinds=kinds_with("ice")):
        try:
            runs.setdefault(record.name, []).append(make_field(record, spread))
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError("\n".join(problems))
    if not runs:
        raise InputError(f"{spec.path}: has no record of kind 'field'; bands need one at least")
    for name, fields in runs.items():
        if len(fields) > 2:
            raise InputError(
                f"{spec.path}: field record '{name}' has {len(fields)} cylinders; at most two"
            )
        first = fields[0]
        for other in fields[1:]:
            same = first.samples == other.samples and np.isclose(first.interval, other.interval)
            if not (same and abs(first.first - other.first) < 0.5 * first.interval):
                raise InputError(
                    f"{spec.path}: cylinders {first.cylinder} and {other.cylinder} of field record "
                    f"'{name}' do not share their sample times; cut them with `rows`, or give them "
                    "names of their own"
                )
    return tuple(tuple(fields) for fields in runs.values())
