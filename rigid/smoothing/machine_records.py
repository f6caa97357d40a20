"""Tests of a machine: what was read at all joints of a test, on one clock."""

from collections.abc import Iterator, Sequence

import numpy as np

from rigid.effects.placed import RIG, those_at
from rigid.io.errors import InputError
from rigid.likelihood.assemble import chosen_effects
from rigid.likelihood.machine import Layout, lay_out
from rigid.likelihood.machine_group import MachineGroup, require_one_clock
from rigid.likelihood.tracks import DONE, Laid, make_track
from rigid.records.record import Record
from rigid.smoothing.field import Channel, Field, Setup
from rigid.smoothing.inputs import LOAD_SIZE, Inputs, Recorded
from rigid.spec import RecordSpec, Spec

SMALL = 0.1
"""Typical size of what was recorded, in its greatest magnitude."""

NODE, SPAN = 4, 2.0
"""Samples between two nodes, and over which the rough path is smoothed: valves and springs of
machines that are not known here may turn within a few samples."""

MOST_OFF = 6.0
"""Standard deviations of noise and zero beyond which a test does not begin at rest."""


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
    _require_at_rest(spec, field, first)
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
    assert spec.machine is not None and spec.bands is not None  # there are loads
    channels, effects = tuple(channel for channel, _, _ in columns), chosen_effects(spec)
    places = {place.name: place for place in layout.places}
    recorded = tuple(i for i, one in enumerate(channels) if one.quantity in DONE)
    commanded = {channels[i].place for i in recorded if channels[i].quantity == "command"}
    flows = tuple(
        name
        for name in places
        if name not in commanded and any(e.equation == "pump" for e in those_at(effects, name))
    )

    def moved(one: Channel) -> tuple[float, ...]:
        joint = places[one.place]
        if one.quantity == "stroke":
            return tuple(a - b for a, b in zip(joint.ahead, joint.behind, strict=True))
        return joint.ahead if one.quantity == "position" else (0.0,) * len(joint.ahead)

    def pressure(name: str) -> int | None:
        here = Channel("pressure", name)
        return channels.index(here) if here in channels else None

    inputs = Inputs(
        spec.bands.loads,
        flows,
        tuple(Recorded(channels[i].quantity, channels[i].place, _size(columns[i][1]))
              for i in recorded),
        LOAD_SIZE * spec.machine.usual.force / RIG.force,
    )  # fmt: skip
    read = [i for i in range(len(channels)) if i not in recorded]
    cells = [
        i for i in read if channels[i].quantity == "load" and channels[i].place in inputs.loads
    ]
    return Setup(
        channels,
        inputs,
        tuple(map(moved, channels)),
        tuple(pressure(place.name) for place in layout.places if place.oil),
        recorded,
        tuple(cells or read),
        NODE,
        SPAN,
    )


def _size(series: np.ndarray) -> float:
    return SMALL * float(np.abs(series).max()) or 1.0


def _require_at_rest(spec: Spec, field: Field, record: Record) -> None:
    """Refuse a test whose first sample tells of a machine that is not at rest."""
    for i in field.setup.read:
        one, sheet = field.setup.channels[i], spec.sensors[field.setup.channels[i].quantity]
        spread = float(np.hypot(sheet.noise + sheet.step, sheet.zero_sd))
        begin = field.reading[0, i]
        if field.known[0, i] and abs(begin) > MOST_OFF * spread:
            raise InputError(
                f"{record.path}: test '{field.name}', joint {one.place}, begins with a "
                f"{one.quantity} of {begin:.4g} (SI); it must begin at rest and out of load, cut "
                "with `rows` where it does"
            )


def read_at(record: RecordSpec) -> tuple[Channel, ...]:
    """What sensors read at one joint of a test."""
    read = (quantity for quantity in MachineGroup.quantities if quantity in record.channels)
    return tuple(Channel(quantity, record.cylinder) for quantity in read)
