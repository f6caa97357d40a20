"""One measured run as a spec states it: its file, its channels, what was done."""

import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from rigid.spec.base import POSITIVE, Flag, Known, Number, Real, Value, Whole, is_number, uncertain

Position = Literal["open", "shut", "tank"]
Kind = Literal["frame", "release", "free-run", "field", "motion"]
Quantity = Literal["time", "load", "stroke", "pressure", "acceleration", "position", "force"]
DefectName = Literal["time-not-increasing", "gap", "nan", "stuck", "saturated", "unit", "too-short"]
"""What can be wrong with a record and be accepted all the same; `rigid.records` finds it."""

Name = Annotated[str, Field(pattern=r"^[^\[\],/\s]([^\[\],/\n\r]*[^\[\],/\s])?$")]
"""Of a record or a cylinder: it stands between brackets and commas in `kappa[free-run-2,A]`."""


def _column(given: Any) -> Any:
    """Refuse what names no column."""
    if isinstance(given, (int, str)) and not isinstance(given, bool) and given != "":
        return given
    raise ValueError(f"must be the name of a column or its number from 1; found {given!r}")


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
        raise ValueError(f"must be a time in s; found {given!r}")
    return given


class Stretch(Value):
    """A position of the valve until a time [s] of the record."""

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
    kind: Kind
    cylinder: Name = "A"
    file: Path
    channels: Mapping[Quantity, ChannelSpec]
    valve: tuple[Stretch, ...] = ()
    preload: Annotated[Known, uncertain(PRELOAD_SHARE), POSITIVE] | None = None
    release_time: Number | None = None
    corner: Annotated[Real, Field(gt=0.0)] | None = None
    fit: Flag = True
    accept: tuple[DefectName, ...] = ()
    rows: Annotated[tuple[Whole, Whole], BeforeValidator(_lines)] | None = None

    @model_validator(mode="before")
    @classmethod
    def defaults(cls, given: Any) -> Any:
        """Fill what depends on the kind: the valve's programme and whether to fit."""
        if not isinstance(given, Mapping):
            return given
        position = "shut" if given.get("kind") == "release" else "open"
        valve = () if given.get("kind") == "motion" else ({"position": position},)
        return {"valve": valve, "fit": given.get("kind") != "field"} | dict(given)

    @model_validator(mode="after")
    def consistent(self) -> "RecordSpec":
        """Refuse what cannot be one run of this kind, each mistake in a sentence."""
        _require_channels(self)
        _require_release(self)
        _require_motion(self)
        if self.kind != "motion":
            _require_programme(self.valve)
        if self.rows is not None and not 1 <= self.rows[0] <= self.rows[1]:
            raise ValueError("rows: the first line must be 1 or more, and not after the last")
        return self


def _require_channels(record: RecordSpec) -> None:
    """Refuse a record without a time or without anything to explain."""
    if "time" not in record.channels:
        raise ValueError("channels needs an entry 'time'")
    if record.kind == "release":
        if "acceleration" not in record.channels:
            raise ValueError("channels: a release needs an entry 'acceleration'")
    elif record.kind == "motion":
        for needed in ("position", "force"):
            if needed not in record.channels:
                raise ValueError(f"channels: a motion needs an entry '{needed}'")
    elif record.kind == "field":
        if len(record.channels) < 2:
            raise ValueError("channels names no quantity beside time")
    elif not {"load", "stroke", "pressure"} & set(record.channels):
        raise ValueError(
            f"channels: a {record.kind} needs at least one of 'load', 'stroke' and 'pressure'"
        )


def _require_release(record: RecordSpec) -> None:
    """Refuse a release without its preload, and what belongs to releases elsewhere."""
    if record.kind == "release":
        if record.preload is None:
            raise ValueError("a release needs its preload, as in { value = 6000.0, sd = 60.0 } (N)")
        if any(s.position != "shut" for s in record.valve):
            raise ValueError("valve: it is shut in a release; leave `valve` out")
        return
    for key in ("preload", "release_time"):
        if getattr(record, key) is not None:
            raise ValueError(f"{key} belongs to a release; this is a {record.kind}")


MOTION_CHANNELS = ("time", "position", "force", "pressure")


def _require_motion(record: RecordSpec) -> None:
    """Refuse in a motion what belongs to the rig, and elsewhere what belongs to a motion."""
    if record.kind == "motion":
        if record.valve:
            raise ValueError("valve: a motion has none; leave `valve` out")
        other = [q for q in record.channels if q not in MOTION_CHANNELS]
        if other:
            raise ValueError(
                f"channels: a motion has no '{other[0]}'; it takes {', '.join(MOTION_CHANNELS)}"
            )
        return
    for quantity in ("position", "force"):
        if quantity in record.channels:
            raise ValueError(f"channels: '{quantity}' belongs to a motion; this is a {record.kind}")
    if record.corner is not None:
        raise ValueError(f"corner belongs to a motion; this is a {record.kind}")


def _require_programme(valve: tuple[Stretch, ...]) -> None:
    """Refuse a valve that goes back in time, or whose programme has no end or no entry."""
    if not valve:
        raise ValueError("valve: the list is empty; leave `valve` out where it stays as it is")
    times = [s.until for s in valve]
    if math.inf in times[:-1]:
        entry = times.index(math.inf) + 1
        raise ValueError(f"valve: entry {entry} lacks `until`; only the last lasts to the end")
    if times[-1] < math.inf:
        raise ValueError(
            f"valve: the last entry ends at {times[-1]:g} s; leave its `until` out, "
            "it lasts to the end of the record"
        )
    for before, after in itertools.pairwise(times):
        if after <= before:
            raise ValueError(
                f"valve: each `until` must lie after the one before; {after:g} follows {before:g}"
            )
