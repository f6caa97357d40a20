"""Units that are doubted: notes where a name or the balance of forces contradicts the spec."""

import dataclasses

import numpy as np
import pytest

from rigid.records import read_record, read_records
from rigid.records.doubts import balanced, misnamed, off_record
from rigid.spec import ChannelSpec, Stretch, find_spec, load_spec

AREA = 44.2e-4  # m^2


def pressed(bench, factor=1.0, **more):
    """A frame whose pressure is S_Pl p = load, times a factor."""
    columns = bench.good()
    columns["load"] = 0.2 * columns["load"]  # up to 24 kN: ten times S_Pl p is in the gauge's range
    flicker = 0.3 * (np.arange(len(columns["time"])) % 5 == 0)  # a gauge in bar
    columns["pressure"] = factor * columns["load"] * 1e3 / AREA / 1e5 + flicker
    return bench.read(columns, **more)


@pytest.mark.parametrize(("factor", "doubted"), [(1.0, 0), (2.0, 0), (10.0, 1), (0.1, 1)])
def test_forces_out_of_balance_are_told_with_both_figures(bench, factor, doubted):
    record = pressed(bench, factor)
    notes = balanced(record, AREA, bench.sensors).notes
    assert len(notes) - len(record.notes) == doubted
    if doubted:
        assert "S_Pl p" in notes[-1]
        load, force = (
            float(notes[-1].split(before)[1].split(" N")[0]) for before in ("load is ", "S_Pl p ")
        )
        assert force / load == pytest.approx(factor, rel=0.05)  # the gauge's flicker of 0.3 bar


def test_a_load_that_counts_the_other_way_is_told(bench):
    record = pressed(bench)
    load = record.channels["load"]
    turned = dataclasses.replace(load, values=-load.values)
    turned = dataclasses.replace(record, channels={**record.channels, "load": turned})
    assert "signs" in balanced(turned, AREA, bench.sensors).notes[-1]


def test_a_valve_that_moves_outside_the_record_is_told(bench):
    """As where its times are in milliseconds; what `rows` has cut away may be meant."""
    record = pressed(bench)
    last = float(record.time[-1])
    inside, outside = (
        (Stretch(until=until, position="open"), Stretch(position="shut"))
        for until in (0.5 * last, 1e3 * last)
    )
    assert not list(off_record(record.time, inside))
    (note,) = off_record(record.time, outside)
    assert f"{1e3 * last:g} s" in note
    assert pressed(bench, valve=outside).notes == (*record.notes, note)


def test_to_the_tank_and_out_of_a_frame_nothing_is_told(bench):
    for more in ({"valve": (Stretch(position="tank"),)}, {"kind": "field", "fit": False}):
        record = pressed(bench, 10.0, **more)
        assert balanced(record, AREA, bench.sensors) is record


def test_noise_alone_says_nothing(bench):
    record = pressed(bench)
    small = {
        quantity: dataclasses.replace(
            channel, values=1e-3 * channel.values * (1 - 2 * (quantity == "load"))
        )
        for quantity, channel in record.channels.items()
    }
    record = dataclasses.replace(record, channels=small)
    assert balanced(record, AREA, bench.sensors) is record


@pytest.mark.parametrize(
    ("quantity", "name", "unit", "said"),
    [
        ("pressure", "p_MPa", "bar", "MPa"),
        ("load", "Force lbf", "kN", "lbf"),
        ("time", "time_ms", "s", "ms"),
        ("pressure", "p_MPa", "MPa", ""),
        ("pressure", "p_MPa", "counts", ""),
        ("acceleration", "a_m/s2", "m/s^2", ""),  # two ways to write one unit
        ("stroke", "s", "mm", ""),  # a name is no unit
        ("stroke", "pos in mm", "cm", ""),  # two units: nothing is said
        ("load", "Load_A", "kN", ""),
    ],
)
def test_a_name_that_says_another_unit(quantity, name, unit, said):
    notes = list(misnamed({quantity: name}, {quantity: unit}))
    assert len(notes) == bool(said)
    assert all(f"says {said}" in note and name in note for note in notes)


def test_a_note_of_the_name_is_the_records(bench):
    columns = bench.good()
    columns["p_MPa"] = columns.pop("pressure")
    channels = bench.channels("time", "load", "stroke")
    channels["pressure"] = ChannelSpec(column="p_MPa", unit="bar")
    bench.write("r.csv", columns)
    (note,) = read_record(bench.spec("r.csv", channels=channels), bench.sensors).notes
    assert note.startswith("pressure: the name of column 'p_MPa' says MPa, the spec 'bar'")


def test_the_reference_campaign_is_in_balance_until_its_pressure_is_read_as_another_unit():
    spec = load_spec(find_spec("calibration"))
    frames = [r for r in spec.records if r.kind == "frame"]
    for unit, doubted in (("bar", 0), ("MPa", 1)):
        given = [
            r.model_copy(
                update={
                    "channels": {
                        **r.channels,
                        "pressure": r.channels["pressure"].model_copy(update={"unit": unit}),
                    },
                    "accept": ("unit", "saturated"),
                }
            )
            for r in frames
        ]
        found = read_records(spec.model_copy(update={"records": tuple(given)}))
        assert [sum("out of balance" in n for n in r.notes) for r in found] == [doubted] * 3
