"""A record that could be taken: like one of those there, some of its settings changed."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.io.errors import InputError
from rigid.kinds import KINDS
from rigid.likelihood.assemble import assemble
from rigid.likelihood.channels import Piece
from rigid.likelihood.machine_group import P_START, V_START, X_START
from rigid.likelihood.parameters import Parameter
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import standard_of
from rigid.localfit.samples import lay_out
from rigid.records.record import Channel, Record
from rigid.spec import Known, Spec
from rigid.spec.record import RecordSpec, Stretch
from rigid.spec.sentences import unknown
from rigid.spec.values import PlanRecordSpec

FLOW, TANK = "kappa", "kappa_tank"
"""Names of flow fractions: of an open valve, and of one that is open to the tank."""
STARTS = (X_START, V_START, P_START)
"""Names of where a run begins that is in motion."""
SET_UP_ANEW = ("preload", "release_time")
"""Names of what a further record has anew: its preload, and when between two samples it begins."""
DRIVES = ("force", "command")
"""Channels that say what was done in a run."""
SETTINGS = (0.5, 1.0, 2.0)
"""Times the preload, the drive or the flow fraction of records, where a spec names none."""


@dataclasses.dataclass(frozen=True)
class Change:
    """One candidate.

    - `like`: name of a record. - `preload`, `flow`: times those of that record. - `drive`: times
      the force or the command that is recorded in a run, and where it begins if it is in motion.
    - `duration`: times how long it and every position of its valve last, and so its stroke.
    - `interval`: times its sampling interval. - `ranges`: times the range of sensors, and with it
      the step of their converters, by quantity. - `cost`: of one such record, in any unit.
    """

    like: str
    preload: float = 1.0
    flow: float = 1.0
    drive: float = 1.0
    duration: float = 1.0
    interval: float = 1.0
    ranges: Mapping[str, float] = dataclasses.field(default_factory=dict)
    cost: float = 1.0

    @property
    def says(self) -> str:
        """What to take, in words."""
        factors = {
            "preload": self.preload,
            "flow fraction": self.flow,
            "drive": self.drive,
            "duration": self.duration,
            "sampling interval": self.interval,
        } | {f"range of {quantity}": by for quantity, by in self.ranges.items()}
        parts = [f"{by:g} times its {what}" for what, by in factors.items() if by != 1.0]
        return f"like {self.like}, {' and '.join(parts)}" if parts else f"{self.like} again"


def usual(spec: Spec, problem: Problem) -> tuple[Change, ...]:
    """Candidates where a spec names none: every record again, and with a setting changed."""
    found: list[Change] = []
    for name in dict.fromkeys(r.name for r in spec.records if r.fit):
        setting = _setting(spec, problem, name)
        again = Change(name)
        found += [again] if setting is None else [_with(again, setting, by) for by in SETTINGS]
    return tuple(found)


def _with(change: Change, setting: str, factor: float) -> Change:
    return dataclasses.replace(change, **{setting: factor})


def _setting(spec: Spec, problem: Problem, name: str) -> str | None:
    """Which setting of a record can be changed."""
    mine = [r for r in spec.records if r.fit and r.name == name]
    if any(r.preload is not None for r in mine):
        return "preload"
    own = {p.base for p in problem.parameters.sampled if p.record == name}
    done = {c for r in mine if KINDS[r.kind].solver == "machine" for c in r.channels}
    if own & {*STARTS} or done & {*DRIVES}:
        return "drive"
    taken = any(track.name == name for track in problem.tracks)
    opened = any(stretch.position != "shut" for r in mine for stretch in r.valve)
    return "flow" if own & {FLOW, TANK} or (opened and not taken) else None


def stated(spec: Spec, problem: Problem) -> tuple[Change, ...]:
    """Candidates that a spec names; `usual` ones where it names none.

    Raises InputError for a record or a setting that is not there.
    """
    if spec.plan is None or not spec.plan.records:
        return usual(spec, problem)
    return tuple(_stated(spec, problem, one) for one in spec.plan.records)


def name_of(one: PlanRecordSpec) -> str:
    """Name of the record that a candidate is like, among the spec's and those of other specs."""
    return one.like if one.spec is None else f"{one.like} of {one.spec.stem}"


def _stated(spec: Spec, problem: Problem, one: PlanRecordSpec) -> Change:
    where = f"{spec.path} [[plan.records]] like"
    mine = [r for r in spec.records if r.fit and r.name == name_of(one)]
    if not mine:
        names = sorted({r.name for r in spec.records if r.fit})
        raise InputError(f"{where}: {unknown('record', one.like, names)}")
    setting = _setting(spec, problem, name_of(one))
    for name in ("preload", "flow", "drive"):
        if getattr(one, name) != 1.0 and setting != name:
            raise InputError(
                f"{where} = '{one.like}': a {mine[0].kind} of this programme has no {name} to "
                f"change; leave `{name}` out"
            )
    if one.duration != 1.0 and setting not in ("preload", "flow"):
        raise InputError(
            f"{where} = '{one.like}': what was done in a {mine[0].kind} is recorded, and would be "
            "done more slowly; leave `duration` out"
        )
    read = sorted({q for r in mine for q in r.channels if q in spec.sensors.stated})
    for quantity in one.ranges:
        if quantity not in read:
            raise InputError(f"{where} = '{one.like}', ranges: {unknown('sensor', quantity, read)}")
    return Change(name_of(one), **one.model_dump(exclude={"spec", "like"}))


def changed(
    spec: Spec, records: tuple[Record, ...], base: Problem, changes: Sequence[Change]
) -> Problem:
    """Return the problem in which the records that candidates are like are those candidates.

    - `spec`, `records`: those of the base, and those of other specs that candidates are like.
    - `base`: problem of the records as they are, weighted for what is correlated in them.
    - `changes`: the same settings of all, by as much; of two that are like one record the last.

    What other records read does not count in it, nor does the data of the candidates mean anything.
    """
    by_name = {one.like: one for one in changes}
    there = {track.name for track in base.tracks} | by_name.keys()
    specs = tuple(
        _restated(r, by_name[r.name]) if r.name in by_name else r
        for r in spec.records
        if r.name in there or not r.fit
    )
    listed = tuple(
        _resampled(r, by_name[r.name]) if r.name in by_name else r
        for r in records
        if r.name in there
    )
    new = assemble(spec.model_copy(update={"records": specs}), listed)
    new = dataclasses.replace(new, pieces=tuple(_ranged(p, changes[0].ranges) for p in new.pieces))
    weight = lay_out(base).mean_weights()
    found = {}
    for piece in new.pieces:
        columns = []
        for i, track in enumerate(piece.tracks):
            here = new.groups[piece.group].tracks[track]
            counts = weight.get((here.label, piece.quantity), 1.0)
            read = np.asarray(piece.weight)[:, i] > 0.0
            columns.append(counts * read if here.name in by_name else 0.0 * read)
        found[piece.group, piece.quantity] = np.stack(columns, axis=1)
    return new.with_weights(found)


def _ranged(piece: Piece, ranges: Mapping[str, float]) -> Piece:
    """The piece as a sensor of another range would read it: its converter counts as many steps."""
    by = ranges.get(piece.quantity, 1.0)
    if by == 1.0:
        return piece
    sheet = dataclasses.replace(piece.sheet, step=by * piece.sheet.step, stated_step=None)
    return dataclasses.replace(piece, sheet=sheet)


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


def _restated(record: RecordSpec, change: Change) -> RecordSpec:
    if record.preload is None:
        return record
    old = record.preload
    new = Known(value=change.preload * old.value, sd=change.preload * old.sd)
    return record.model_copy(update={"preload": new})


def _slowed(valve: tuple[Stretch, ...], first: float, by: float) -> tuple[Stretch, ...]:
    """The valve's programme, every position of it held for `by` times its time from the first."""
    return tuple(
        one.model_copy(update={"until": first + by * (one.until - first)}) for one in valve
    )


def _resampled(record: Record, change: Change) -> Record:
    """The record driven otherwise, for another time and at other instants.

    Its own readings nearby stand in for those of the sensors, until these are simulated; forces and
    commands are straight lines between samples.
    """
    step, first = change.interval * record.interval, record.time[0]
    same = change.interval == change.duration == 1.0
    count = int(np.floor(change.duration * (record.time[-1] - first) / step)) + 1
    time = record.time if same else first + step * np.arange(count)
    recorded = first + (time - first) / change.duration
    near = np.clip(np.searchsorted(record.time, recorded), None, len(record.time) - 1)
    given = DRIVES if KINDS[record.kind].solver == "machine" else ()
    channels = {}
    for name, one in record.channels.items():
        values = one.values[near]
        if name in given:
            values = change.drive * np.interp(time, record.time, one.values)
        channels[name] = Channel(name, values, one.valid[near], one.column, one.unit)
    return dataclasses.replace(
        record, time=time, channels=channels, interval=step, uniform=record.uniform or not same,
        valve=_slowed(record.valve, float(first), change.duration),
    )  # fmt: skip


def placed(
    base: Problem, new: Problem, changes: Sequence[Change], z: Float[np.ndarray, " size"]
) -> Float[np.ndarray, " more"]:
    """Return z of the changed problem for z of that of the records as they are."""
    return moved(base.parameters.sampled, new.parameters.sampled, changes, z)


def moved(
    base: Sequence[Parameter],
    new: Sequence[Parameter],
    changes: Sequence[Change],
    z: Float[np.ndarray, " size"],
) -> Float[np.ndarray, " more"]:
    """The same for numbers listed for both; what the base does not have is at its median."""
    by_name = {one.like: one for one in changes}
    known = {old.label: (old, value) for old, value in zip(base, z, strict=False)}
    out = np.zeros(len(new))
    for i, one in enumerate(new):
        change = by_name.get(one.record)
        old, value = known.get(one.label, (one, 0.0))
        out[i] = value
        if change is None:
            continue
        times = {FLOW: change.flow, TANK: change.flow} | dict.fromkeys(STARTS, change.drive)
        factor = times.get(one.base, 1.0)
        if factor != 1.0:
            out[i] = standard_of(one.prior, float(old.prior.from_standard(value)) * factor)
    return out


def own(problem: Problem, change: Change) -> list[Parameter]:
    """Uncertain numbers that are the candidate's own: another record of its kind has others."""
    return [one for one in problem.parameters.sampled if one.record == change.like]


def anew(
    problem: Problem, change: Change, z: Float[np.ndarray, " size"], rng: np.random.Generator
) -> Float[np.ndarray, " size"]:
    """Draw what the candidate has anew from its prior."""
    listed = problem.parameters.sampled
    new = [one.record == change.like and one.base in SET_UP_ANEW for one in listed]
    return np.where(new, rng.standard_normal(len(z)), z)
