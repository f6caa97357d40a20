"""One measured run as a spec states it: its file, its channels, what was done."""

import itertools
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from rigid.io.errors import quoted
from rigid.kinds import KINDS, Position, RecordKind
from rigid.spec.base import POSITIVE, Flag, Known, Number, Real, Value, Whole, is_number, uncertain
from rigid.spec.sentences import unknown

Quantity = Literal[
    "time", "load", "stroke", "pressure", "acceleration", "position", "force", "command"
]
DefectName = Literal["time-not-increasing", "gap", "nan", "stuck", "saturated", "unit", "too-short"]
"""What can be wrong with a record and be accepted all the same; `rigid.records` finds it."""

Name = Annotated[str, Field(pattern=r"^[^\[\],/\s]([^\[\],/\n\r]*[^\[\],/\s])?$")]
"""Of a record or a cylinder: it stands between brackets and commas in `kappa[free-run-2,A]`."""


def _column(given: Any) -> Any:
    """Refuse what names no column."""
    if isinstance(given, (int, str)) and not isinstance(given, bool) and given != "":
        return given
    raise ValueError(f"must be the name of a column or its number from 1; found {quoted(given)}")


def _kind(given: Any) -> Any:
    """Refuse what is no kind of record."""
    if not isinstance(given, str):
        raise ValueError(f"must be one of {', '.join(KINDS)}; found {quoted(given)}")
    if given not in KINDS:
        raise ValueError(unknown("kind", given, KINDS))
    return given


class ChannelSpec(Value):
    """Where a channel stands in a file: `column` by name or number from 1, its `unit`.

    SI value = (number * scale or factor of the unit) + offset.
    """

    column: Annotated[str | Whole, BeforeValidator(_column)]
    unit: str
    scale: Real | None = None
    offset: Real = 0.0


def _until(given: Any) -> Any:
    """Refuse a time that is no number; the last stretch lasts without end."""
    if not is_number(given) or math.isnan(given):
        raise ValueError(f"must be a time in s; found {quoted(given)}")
    return given


def _without_end(schema: dict[str, Any]) -> None:
    """Take from a JSON Schema the default that JSON cannot say."""
    del schema["properties"]["until"]["default"]


class Stretch(Value):
    """A position of the valve until a time [s] of the record."""

    model_config = ConfigDict(json_schema_extra=_without_end)

    until: Annotated[float, Field(allow_inf_nan=True), BeforeValidator(_until)] = math.inf
    position: Position


def _lines(given: Any) -> Any:
    """Refuse what is no first and last line of a file."""
    if not isinstance(given, (list, tuple)) or len(given) != 2:
        raise ValueError("must be two line numbers, as in [5, 1200]")
    return given


PRELOAD_SHARE = 0.01
"""Relative sd of a preload where a spec states none."""


class RecordSpec(Value):
    """One cylinder in one measured run."""

    name: Name
    kind: Annotated[str, BeforeValidator(_kind), Field(json_schema_extra={"enum": [*KINDS]})]
    cylinder: Name = "A"
    file: Path
    channels: Mapping[Quantity, ChannelSpec] = {}
    valve: tuple[Stretch, ...] = ()
    preload: Annotated[Known, uncertain(PRELOAD_SHARE), POSITIVE] | None = None
    release_time: Number | None = None
    corner: Annotated[Real, Field(gt=0.0)] | None = None
    start: Literal["rest", "moving"] | None = None
    fit: Flag = True
    accept: tuple[DefectName, ...] = ()
    rows: Annotated[tuple[Whole, Whole], BeforeValidator(_lines)] | None = None

    @model_validator(mode="before")
    @classmethod
    def defaults(cls, given: Any) -> Any:
        """Fill what depends on the kind: the valve's programme and whether to fit."""
        if not isinstance(given, Mapping):
            return given
        name = given.get("kind")
        kind = KINDS.get(name, RecordKind) if isinstance(name, str) else RecordKind
        valve = () if kind.valve is None else ({"position": kind.valve},)
        return {"valve": valve, "fit": kind.fit} | dict(given)

    @model_validator(mode="after")
    def consistent(self) -> "RecordSpec":
        """Refuse what cannot be one run of this kind, each mistake in a sentence."""
        kind = KINDS[self.kind]
        says = [*_channel_faults(self, kind), *_own_faults(self, kind)]
        says += _valve_faults(self.valve, kind)
        if self.rows is not None and not 1 <= self.rows[0] <= self.rows[1]:
            says.append("rows: the first line must be 1 or more, and not after the last")
        if says or (says := [one for one in (kind.fault(self),) if one]):
            raise ValueError("\n".join(says))
        return self


def _channel_faults(record: RecordSpec, kind: type[RecordKind]) -> Iterator[str]:
    """Say that time is missing, or anything to explain, or what its kind needs or cannot have."""
    if "channels" not in record.model_fields_set:
        yield (
            "channels: is missing; end the record with a table [records.channels], or write "
            f"[channels.{record.cylinder}] for the records of this cylinder that have none"
        )
        return
    if "time" not in record.channels:
        yield "channels needs an entry 'time'"
    for needed in kind.needs:
        if needed not in record.channels:
            yield f"channels: a {kind.name} needs an entry '{needed}'"
    if kind.one_of and not set(kind.one_of) & set(record.channels):
        *most, last = (f"'{quantity}'" for quantity in kind.one_of)
        any_of = f"{', '.join(most)} and {last}" if most else last
        yield f"channels: a {kind.name} needs at least one of {any_of}"
    elif not kind.needs and set(record.channels) <= {"time"}:
        yield "channels names no quantity beside time"
    for quantity in record.channels:
        if quantity in kind.takes:
            continue
        if kind.takes != RecordKind.takes:
            takes = ", ".join(kind.takes)
            yield f"channels: a {kind.name} has no '{quantity}'; it takes {takes}"
            continue
        owner = next(k.name for k in KINDS.values() if quantity in k.takes)
        yield f"channels: '{quantity}' belongs to a {owner}; this is a {kind.name}"


def _own_faults(record: RecordSpec, kind: type[RecordKind]) -> Iterator[str]:
    """Say what of its kind a record does not state, and what it states of other kinds."""
    for key, example in kind.own.items():
        if example and getattr(record, key) is None:
            yield f"a {kind.name} needs its {key}, as in {example}"
    for other in KINDS.values():
        for key in other.own:
            if key not in kind.own and getattr(record, key) is not None:
                yield f"{key} belongs to a {other.name}; this is a {kind.name}"


def _valve_faults(valve: tuple[Stretch, ...], kind: type[RecordKind]) -> Iterator[str]:
    """Say that there is no valve, that it is held, or that it has no programme."""
    if kind.valve is None:
        if valve:
            yield f"valve: a {kind.name} has none; leave `valve` out"
        return
    if kind.held and any(s.position != kind.valve for s in valve):
        yield f"valve: it is {kind.valve} in a {kind.name}; leave `valve` out"
    if says := _programme_fault(valve):
        yield f"valve: {says}"


def _programme_fault(valve: tuple[Stretch, ...]) -> str:
    """Say that a programme is empty, goes back in time or has no end; empty where nothing is."""
    if not valve:
        return (
            "the list is empty; write when it moves, as in [{ until = 2.5, position = 'open' }, "
            "{ position = 'shut' }], or leave `valve` out where it stays as it is"
        )
    times = [s.until for s in valve]
    if math.inf in times[:-1]:
        entry = times.index(math.inf) + 1
        return f"entry {entry} lacks `until`; only the last lasts to the end"
    if times[-1] < math.inf:
        return (
            f"the last entry ends at {times[-1]:g} s; leave its `until` out, "
            "it lasts to the end of the record"
        )
    for before, after in itertools.pairwise(times):
        if after <= before:
            return f"each `until` must lie after the one before; {after:g} follows {before:g}"
    return ""
