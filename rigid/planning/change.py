"""A record that could be taken: like one of those there, some of its settings changed."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.io.errors import InputError
from rigid.kinds import KINDS
from rigid.likelihood.assemble import assemble
from rigid.likelihood.parameters import Parameter
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import standard_of
from rigid.records.record import Channel, Record
from rigid.spec import Known, Spec
from rigid.spec.record import RecordSpec
from rigid.spec.sentences import unknown
from rigid.spec.values import PlanRecordSpec

FLOW, TANK = "kappa", "kappa_tank"
"""Names of flow fractions: of an open valve, and of one that is open to the tank."""
SETTINGS = (0.5, 1.0, 2.0)
"""Times the preload or the flow fraction of records, where a spec names no candidates."""


@dataclasses.dataclass(frozen=True)
class Change:
    """One candidate.

    - `like`: name of a record. - `preload`, `flow`: times those of that record. - `interval`: times
      its sampling interval. - `cost`: of one such record, in any unit.
    """

    like: str
    preload: float = 1.0
    flow: float = 1.0
    interval: float = 1.0
    cost: float = 1.0

    @property
    def says(self) -> str:
        """What to take, in words."""
        factors = {
            "preload": self.preload,
            "flow fraction": self.flow,
            "sampling interval": self.interval,
        }
        parts = [f"{by:g} times its {what}" for what, by in factors.items() if by != 1.0]
        return f"like {self.like}, {' and '.join(parts)}" if parts else f"{self.like} again"


def usual(spec: Spec) -> tuple[Change, ...]:
    """Candidates where a spec names none: every record again, and with a setting changed."""
    found: dict[Change, None] = {}
    for r in (r for r in spec.records if r.fit):
        for factor in SETTINGS:
            name = _setting(r)
            found[Change(r.name) if name is None else Change(r.name, **{name: factor})] = None
    return tuple(found)


def _setting(record: RecordSpec) -> str | None:
    """Which setting of a record can be changed."""
    if record.preload is not None:
        return "preload"
    opened = {"open", "tank"} & {stretch.position for stretch in record.valve}
    return "flow" if KINDS[record.kind].valve is not None and opened else None


def stated(spec: Spec) -> tuple[Change, ...]:
    """Candidates that a spec names; `usual` ones where it names none.

    Raises InputError for a record or a setting that is not there.
    """
    if spec.plan is None or not spec.plan.records:
        return usual(spec)
    return tuple(_stated(spec, one) for one in spec.plan.records)


def _stated(spec: Spec, one: PlanRecordSpec) -> Change:
    where = f"{spec.path} [[plan.records]] like"
    mine = [r for r in spec.records if r.fit and r.name == one.like]
    if not mine:
        names = sorted({r.name for r in spec.records if r.fit})
        raise InputError(f"{where}: {unknown('record', one.like, names)}")
    setting = _setting(mine[0])
    for name in ("preload", "flow"):
        if getattr(one, name) != 1.0 and setting != name:
            raise InputError(
                f"{where} = '{one.like}': a {mine[0].kind} of this programme has no {name} to "
                f"change; leave `{name}` out"
            )
    return Change(one.like, one.preload, one.flow, one.interval, one.cost)


def changed(spec: Spec, records: tuple[Record, ...], base: Problem, change: Change) -> Problem:
    """Return the problem in which the record that is like the candidate is the candidate.

    - `base`: problem of the records as they are, weighted for what is correlated in them.

    What other records read does not count in it, nor does the data of the candidate mean anything.
    """
    specs = tuple(_restated(r, change) if r.name == change.like else r for r in spec.records)
    listed = tuple(_resampled(r, change) if r.name == change.like else r for r in records)
    new = assemble(spec.model_copy(update={"records": specs}), listed)
    weight = _mean_weights(base)
    found = {}
    for piece in new.pieces:
        columns = []
        for i, track in enumerate(piece.tracks):
            here = new.groups[piece.group].tracks[track]
            counts = weight.get((here.label, piece.quantity), 1.0)
            read = np.asarray(piece.weight)[:, i] > 0.0
            columns.append(counts * read if here.name == change.like else 0.0 * read)
        found[piece.group, piece.quantity] = np.stack(columns, axis=1)
    return new.with_weights(found)


class Taken(NamedTuple):
    """A candidate as it stands in a spec and among records, under a name of its own."""

    specs: tuple[RecordSpec, ...]
    records: tuple[Record, ...]


def as_taken(spec: Spec, records: tuple[Record, ...], change: Change, name: str) -> Taken:
    """Return the candidate as one more record; its readings are those of the one it is like."""
    specs = (_restated(r, change) for r in spec.records if r.name == change.like)
    listed = (_resampled(r, change) for r in records if r.name == change.like)
    return Taken(
        tuple(one.model_copy(update={"name": name}) for one in specs),
        tuple(dataclasses.replace(one, name=name) for one in listed),
    )


def _mean_weights(problem: Problem) -> dict[tuple[str, str], float]:
    """Weight of a sample of each channel that counts, by label of the track and quantity."""
    found = {}
    for piece in problem.pieces:
        for i, track in enumerate(piece.tracks):
            column = np.asarray(piece.weight)[:, i]
            label = problem.groups[piece.group].tracks[track].label
            if (column > 0.0).any():
                found[label, piece.quantity] = float(column[column > 0.0].mean())
    return found


def _restated(record: RecordSpec, change: Change) -> RecordSpec:
    if record.preload is None:
        return record
    old = record.preload
    new = Known(value=change.preload * old.value, sd=change.preload * old.sd)
    return record.model_copy(update={"preload": new})


def _resampled(record: Record, change: Change) -> Record:
    """The record at other instants: its next samples stand in, until readings are simulated."""
    if change.interval == 1.0:
        return record
    step = change.interval * record.interval
    count = int(np.floor((record.time[-1] - record.time[0]) / step)) + 1
    time = record.time[0] + step * np.arange(count)
    near = np.clip(np.searchsorted(record.time, time), None, len(record.time) - 1)
    channels = {
        name: Channel(name, one.values[near], one.valid[near], one.column, one.unit)
        for name, one in record.channels.items()
    }
    return dataclasses.replace(record, time=time, channels=channels, interval=step, uniform=True)


def placed(
    base: Problem, new: Problem, change: Change, z: Float[np.ndarray, " size"]
) -> Float[np.ndarray, " size"]:
    """Return z of the changed problem for z of that of the records as they are."""
    out = np.array(z)
    for i, one in enumerate(new.parameters.sampled):
        if one.base in (FLOW, TANK) and one.record == change.like and change.flow != 1.0:
            value = float(base.parameters.sampled[i].prior.from_standard(z[i])) * change.flow
            out[i] = standard_of(one.prior, value)
    return out


def own(problem: Problem, change: Change) -> list[Parameter]:
    """Uncertain numbers that are the candidate's own: another record of its kind has others."""
    return [one for one in problem.parameters.sampled if one.record == change.like]


def limits_of(spec: Spec) -> dict[str, float]:
    """Greatest reading by quantity: the sensors' ranges, within what the spec allows."""
    most = {} if spec.plan is None else {str(q): end for q, end in spec.plan.limits.items()}
    ends = {quantity: sheet.range[1] for quantity, sheet in spec.sensors.stated.items()}
    kept = {quantity: min(end, most.get(quantity, np.inf)) for quantity, end in ends.items()}
    return {**kept, "flow fraction": 1.0}
