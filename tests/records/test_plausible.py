import numpy as np
import pytest

from rigid.records import read_record
from rigid.spec import ChannelSpec


def test_hints_name_one_unit_the_likeliest(bench):
    columns = bench.good()
    channels = bench.channels(*columns)
    hints = {"load": ("N", "kN"), "stroke": ("m", "mm"), "pressure": ("Pa", "bar")}
    for quantity, (given, right) in hints.items():
        wrong = channels | {quantity: ChannelSpec(column=quantity, unit=given)}
        message = bench.refusal(bench.read, columns, channels=wrong)
        assert f"the unit is given as {given!r}, {right!r} would be plausible" in message
        assert len(message.splitlines()) == 1


@pytest.mark.parametrize(("factor", "interval"), [(1000, 10), (100, 1)])
def test_milliseconds_given_as_seconds(factor, interval, bench):
    columns = bench.good()
    columns["time"] = np.round(columns["time"] * factor, 3)
    message = bench.refusal(bench.read, columns)
    assert f"the sampling interval, {interval} s, is implausibly long" in message
    assert "given as 's', 'ms' would be plausible" in message
    assert len(bench.read(columns, accept=("unit", "stuck")).time) == 400


def test_seconds_given_as_milliseconds(bench):
    channels = bench.channels("time", "load", "stroke", "pressure")
    channels["time"] = ChannelSpec(column="time", unit="ms")
    message = bench.refusal(bench.read, bench.good(), channels=channels)
    assert "implausibly short; the unit is given as 'ms', 's' would be plausible" in message


def free_run():
    count = np.arange(400)
    return {
        "time": count * 0.01,
        "load": 0.295 * (count % 3 - 1),
        "stroke": np.round(0.2 * np.floor(count / 2), 3),
        "pressure": 0.3 * (count % 2),
    }


def test_a_free_run_in_metres_given_as_millimetres(bench):
    columns = free_run()
    assert bench.read(columns, kind="free-run").notes == ()
    columns["stroke"] = columns["stroke"] / 1000
    message = bench.refusal(bench.read, columns, kind="free-run")
    assert "stroke changes by 3.98e-05 m in all, less than 0.001 m" in message
    assert "given as 'mm', 'm' would be plausible" in message


@pytest.mark.parametrize("kind", ["free-run", "field"])
def test_kilonewtons_given_as_newtons(kind, bench):
    columns = free_run()
    channels = bench.channels(*columns) | {"load": ChannelSpec(column="load", unit="N")}
    message = bench.refusal(bench.read, columns, kind=kind, channels=channels)
    assert "load changes by 0.295 N between samples, the sensor by 295 N" in message
    assert "given as 'N', 'kN' would be plausible" in message


def release(peak):
    count = np.arange(400)
    ring = peak * np.exp(-count / 100) * np.cos(count / 5)
    return {"time": count * 0.001, "acceleration": 1.0 + np.where(count < 50, 0.0, ring)}


@pytest.mark.parametrize(("peak", "seen"), [(20.0, True), (2.0, False)])
def test_a_release_stands_above_the_noise(peak, seen, bench):
    channel = ChannelSpec(column="acceleration", unit="m/s^2")
    channels = bench.channels("time", "acceleration") | {"acceleration": channel}
    given = {"kind": "release", "preload": {"value": 6000.0, "sd": 60.0}, "channels": channels}
    if seen:
        assert bench.read(release(peak), **given).notes == ()
        return
    message = bench.refusal(bench.read, release(peak), **given)
    assert "not above 8 times the sensor's noise of 0.35 m/s^2: no release is seen" in message
    assert 'accept = ["unit"]' in message
    assert len(bench.read(release(peak), accept=("unit",), **given).time) == 400


def test_a_unit_that_the_file_contradicts(bench):
    columns = bench.good()
    bench.write("r.csv", columns)
    names, rows = (bench.folder / "r.csv").read_text().split("\n", 1)
    bench.text("row.csv", f"{names}\ns,N,mm,kPa\n{rows}")
    bench.text("names.csv", f"time [ms],load,stroke,pressure\n{rows}")
    spec = bench.spec("row.csv")
    lines = bench.refusal(read_record, spec, bench.sensors).splitlines()
    assert len(lines) == 2
    assert "load: the file gives the unit 'N', the spec 'kN'" in lines[0]
    assert "pressure: the file gives the unit 'kPa', the spec 'bar'" in lines[1]
    notes = read_record(spec.model_copy(update={"accept": ("unit",)}), bench.sensors).notes
    assert [note.split(":")[0] for note in notes] == ["accepted (unit)"] * 2
    time = {"time": ChannelSpec(column="time [ms]", unit="s")}
    spec = bench.spec("names.csv", channels=spec.channels | time)
    message = bench.refusal(read_record, spec, bench.sensors)
    assert "time: the file gives the unit 'ms', the spec 's'" in message


def test_a_refused_unit_hides_what_it_saturates(bench):
    columns = bench.good()
    columns["load"] *= 1000
    assert "saturated" not in bench.refusal(bench.read, columns)
    assert "saturated" in bench.refusal(bench.read, columns, accept=("unit",))
