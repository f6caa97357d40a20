"""Tests of a machine: what was read at all joints of a test, on one clock."""

from collections.abc import Iterator, Sequence

import numpy as np

from rigid.effects.placed import RIG, those_at
from rigid.io.errors import InputError
from rigid.likelihood.assemble import chosen_effects
from rigid.likelihood.machine import Layout, Place, lay_out
from rigid.likelihood.machine_group import MachineGroup, require_one_clock
from rigid.likelihood.tracks import DONE, Laid, make_track
from rigid.records.record import Record
from rigid.smoothing.field import Channel, Field, Setup
from rigid.smoothing.inputs import LOAD_SIZE, Inputs, Recorded
from rigid.smoothing.rest import require_at_rest
from rigid.spec import RecordSpec, Spec

SMALL = 0.1
"""Typical size of what was recorded, in its greatest magnitude."""

NODE, AHEAD, SPAN = 1, 0.5, 0.5
"""Samples between two nodes, by which a node lies behind its sample (in the middle of its
interval), and over which the rough path is smoothed: sensors of machines that are not known here
may be so fine that oil between two samples is no longer the same spring."""


def make_test(spec: Spec, records: Sequence[Record]) -> Field:
    """Lay the records of one test, one a joint, on their grid.

    Raises InputError where no load is sought, clocks differ, or the test does not begin at rest.
    """
    assert spec.machine is not None  # a test has one
    loads = () if spec.bands is None else spec.bands.loads
    if not loads:
        raise InputError(
            f"{spec.path} [bands]: no load is sought; name its joint, as in loads = "
            f'["{[*spec.machine.joints][-1]}"]'
        )
    laid = [make_track(record) for record in records]
    require_one_clock([one.track for one in laid])
    columns = [*_columns(laid)]
    first = records[0]
    field = Field(
        name=first.name,
        place="",
        files={f"{r.name},{r.cylinder}": r.sha256 for r in records},
        first=float(laid[0].track.first),
        interval=first.interval,
        reading=np.stack([values for _, values, _ in columns], axis=1),
        known=np.stack([known for _, _, known in columns], axis=1),
        setup=_setup(spec, lay_out(spec.machine), columns),
        kind=first.kind,
    )
    require_at_rest(field, spec.sensors, f"{first.path}: test '{first.name}', joint")
    return field


Column = tuple[Channel, np.ndarray, np.ndarray]
"""What a series of readings is, the series, and where it is known."""


def _columns(laid: Sequence[Laid]) -> Iterator[Column]:
    """All series of a test, joint by joint; what was recorded of the drive last at each."""
    for one in laid:
        series, given, joint = one.series, one.track.given, one.track.cylinder
        for quantity in MachineGroup.quantities:
            if series.has(quantity):
                weight = series.weight[quantity]
                yield Channel(quantity, joint), series.data[quantity], weight
        assert given is not None  # as of every run of a machine
        for quantity in DONE:
            if (done := getattr(given, quantity)) is not None:
                yield Channel(quantity, joint), np.asarray(done), np.ones(len(done))


def _setup(spec: Spec, layout: Layout, columns: Sequence[Column]) -> Setup:
    """How what was read tells of the machine."""
    channels = tuple(channel for channel, _, _ in columns)
    recorded = tuple(i for i, one in enumerate(channels) if one.quantity in DONE)
    inputs = _inputs(spec, layout, [columns[i] for i in recorded])
    places = {place.name: place for place in layout.places}
    read = tuple(i for i in range(len(channels)) if i not in recorded)
    cells = (i for i in read if channels[i].quantity == "load")
    oil = (Channel("pressure", place.name) for place in layout.places if place.oil)
    return Setup(
        channels=channels,
        inputs=inputs,
        moved=tuple(_moved(one, places[one.place]) for one in channels),
        oil=tuple(channels.index(one) if one in channels else None for one in oil),
        recorded=recorded,
        lively=tuple(i for i in cells if channels[i].place in inputs.loads) or read,
        node=NODE,
        ahead=AHEAD,
        span=SPAN,
    )


def _inputs(spec: Spec, layout: Layout, recorded: Sequence[Column]) -> Inputs:
    """What drives a test: loads where they are sought, valves without a command."""
    assert spec.machine is not None
    assert spec.bands is not None  # some load is sought
    effects = chosen_effects(spec)
    commanded = {one.place for one, _, _ in recorded if one.quantity == "command"}
    pumped = (
        place.name
        for place in layout.places
        if any(effect.equation == "pump" for effect in those_at(effects, place.name))
    )
    return Inputs(
        loads=spec.bands.loads,
        flows=tuple(name for name in pumped if name not in commanded),
        recorded=tuple(Recorded(c.quantity, c.place, _size(done)) for c, done, _ in recorded),
        size=LOAD_SIZE * spec.machine.usual.force / RIG.force,
    )


def _moved(one: Channel, joint: Place) -> tuple[float, ...]:
    """By how much a reading changes with each coordinate."""
    if one.quantity == "stroke":
        return tuple(a - b for a, b in zip(joint.ahead, joint.behind, strict=True))
    return joint.ahead if one.quantity == "position" else (0.0,) * len(joint.ahead)


def _size(series: np.ndarray) -> float:
    return SMALL * float(np.abs(series).max()) or 1.0


def read_at(record: RecordSpec) -> tuple[Channel, ...]:
    """What sensors read at one joint of a test."""
    read = (quantity for quantity in MachineGroup.quantities if quantity in record.channels)
    return tuple(Channel(quantity, record.cylinder) for quantity in read)
