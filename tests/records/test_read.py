import hashlib

import numpy as np
import pytest

from rigid.records import read_record, read_records
from rigid.records.files import load
from rigid.records.record import grid
from rigid.spec import ChannelSpec, Known, Spec, Stretch


def test_values_are_si_and_read_only(bench):
    columns = bench.good()
    record = bench.read(columns)
    np.testing.assert_allclose(record.channels["load"].values, columns["load"] * 1e3)
    np.testing.assert_allclose(record.channels["stroke"].values, columns["stroke"] * 1e-3)
    np.testing.assert_allclose(record.channels["pressure"].values, columns["pressure"] * 1e5)
    np.testing.assert_array_equal(record.time, columns["time"])
    assert "time" not in record.channels
    arrays = [record.time, *(a for c in record.channels.values() for a in (c.values, c.valid))]
    assert not any(array.flags.writeable for array in arrays)
    with pytest.raises(TypeError):
        record.channels["load"] = None


def test_what_the_spec_says_is_carried(bench):
    valve = (Stretch(until=2.0, position="shut"), Stretch(position="tank"))
    record = bench.read(bench.good(), valve=valve)
    assert (record.name, record.kind, record.cylinder) == ("r", "frame", "A")
    assert (record.valve, record.preload, record.release_time) == (valve, None, None)
    assert record.path == bench.folder / "r.csv"
    assert record.sha256 == hashlib.sha256(record.path.read_bytes()).hexdigest()
    load = record.channels["load"]
    assert (load.quantity, load.column, load.unit) == ("load", "load", "kN")


def test_what_the_spec_says_of_a_release_is_carried(bench):
    preload, release = Known(value=6000.0, sd=60.0), Known(value=0.1, sd=0.01)
    count = np.arange(100)
    columns = {"time": count * 0.001, "acceleration": np.sin(count)}
    record = bench.read(columns, kind="release", preload=preload, release_time=release)
    assert (record.preload, record.release_time) == (preload, release)


def test_offset_and_counts(bench):
    columns = bench.good()
    columns["load"] = np.round(columns["load"] / 0.295)
    channels = bench.channels("time", "pressure") | {
        "load": ChannelSpec(column="load", unit="counts", scale=295.0, offset=-590.0)
    }
    found = bench.read(columns, channels=channels).channels["load"].values
    np.testing.assert_allclose(found, columns["load"] * 295.0 - 590.0)


def test_columns_by_number(bench):
    bench.write("r.csv", bench.good())
    lines = (bench.folder / "r.csv").read_text().split("\n", 1)
    bench.text("bare.csv", lines[1])
    channels = {
        "time": ChannelSpec(column=1, unit="s"),
        "load": ChannelSpec(column=2, unit="kN"),
    }
    for file in ("r.csv", "bare.csv"):
        record = read_record(bench.spec(file, channels=channels), bench.sensors)
        np.testing.assert_allclose(record.channels["load"].values, bench.good()["load"] * 1e3)


def test_rows_are_lines_of_the_file(bench):
    record = bench.read(bench.good(), rows=(302, 401))
    assert len(record.time) == 100
    assert record.time[0] == 3.0  # the clock stays that of the file
    message = bench.refusal(bench.read, bench.good(), rows=(500, 600))
    assert "rows 500 to 600 hold no samples; the file's samples stand in lines 2 to 401" in message


def channel_refusal(bench, quantity="load", **given):
    bench.write("r.csv", bench.good() | {"when": np.zeros(400)})
    text = (bench.folder / "r.csv").read_text().split("\n")
    rows = [row.rsplit(",", 1)[0] + f",2024-01-01 10:00:{k % 60:02}" for k, row in enumerate(text)]
    bench.text("r.csv", "\n".join([text[0] + ",event", *(r + ",go" for r in rows[1:-1])]))
    channels = bench.channels("time", "load") | {quantity: ChannelSpec(**given)}
    spec = bench.spec("r.csv", channels=channels)
    return bench.refusal(read_record, spec, bench.sensors)


REFUSED = {
    "near": ({"column": "laod", "unit": "kN"}, "no column 'laod'; did you mean 'load'? it has"),
    "far": ({"column": "xyz", "unit": "kN"}, "no column 'xyz'; it has 'time', 'load', 'stroke'"),
    "number": ({"column": 9, "unit": "kN"}, "no column 9; "),
    "number 0": ({"column": 0, "unit": "kN"}, "no column 0; "),
    "words": ({"column": "event", "unit": "kN"}, "not all numbers: line 2 holds 'go'"),
    "stamps": ({"column": "when", "unit": "kN"}, "holds time stamps; name another column"),
    "unit": ({"column": "load", "unit": "bar"}, "load: the unit 'bar' is a unit of pressure"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_channel_refusals(case, bench):
    given, says = REFUSED[case]
    message = channel_refusal(bench, **given)
    assert says in message
    assert message.startswith(f"{bench.folder / 'r.csv'}: record 'r', load: ")


def test_time_stamps_need_their_unit(bench):
    assert "set unit = 'timestamp'" in channel_refusal(bench, "time", column="when", unit="s")
    assert "numbers, no time stamps" in channel_refusal(
        bench, "time", column="time", unit="timestamp"
    )


def test_an_empty_column(bench):
    columns = bench.good()
    columns["load"][:] = np.nan
    assert "column 'load' holds no number at all" in bench.refusal(bench.read, columns)


def test_one_sample(bench):
    columns = {name: values[:1] for name, values in bench.good().items()}
    assert "1 samples, too few" in bench.refusal(bench.read, columns)


def test_records_of_a_spec(bench, monkeypatch):
    reads = []
    monkeypatch.setattr("rigid.records.read.load", lambda path: reads.append(path) or load(path))
    bench.write("r.csv", bench.good())
    records = (
        bench.spec("r.csv", name="one"),
        bench.spec("r.csv", name="one", cylinder="B"),
        bench.spec("missing.csv", name="left out", fit=False),
    )
    found = read_records(made(bench, records))
    assert [(r.name, r.cylinder) for r in found] == [("one", "A"), ("one", "B")]
    assert reads == [bench.folder / "r.csv"]


def test_records_of_some_kinds(bench):
    bench.write("r.csv", bench.good())
    records = (
        bench.spec("missing.csv", name="frame"),
        bench.spec("r.csv", name="out", kind="field", fit=False),
    )
    assert [r.name for r in read_records(made(bench, records), kinds=("field",))] == ["out"]


def test_problems_of_all_files_come_together(bench):
    columns = bench.good()
    columns["load"][7] = np.nan
    bench.write("nan.csv", columns)
    bench.text("empty.csv", "")
    files = ("nan.csv", "empty.csv", "gone.csv", "gone.csv")
    records = tuple(bench.spec(f, name=f"r{k}") for k, f in enumerate(files))
    lines = bench.refusal(read_records, made(bench, records)).splitlines()
    assert len(lines) == 3
    for line, words in zip(lines, ("line 9", "is empty", "no such file"), strict=True):
        assert words in line


def test_the_accelerometer_sample_is_a_record(bench, shared):
    scale = 9.80665 / 13108
    channels = {
        "time": ChannelSpec(column="time", unit="s"),
        "acceleration": ChannelSpec(column="Az", unit="counts", scale=scale),
    }
    file = str(shared / "accelerometer" / "gcdc-x2-2.csv")
    spec = bench.spec(file, channels=channels, kind="field")
    message = bench.refusal(read_record, spec, bench.sensors)
    assert "time: line 17: samples are missing, the time steps by 0.03125 s" in message
    record = read_record(spec.model_copy(update={"accept": ("gap",)}), bench.sensors)
    assert record.interval == pytest.approx(1 / 64, rel=1e-4)  # its clock drifts
    assert record.uniform
    assert len(record.time) == 1375
    assert record.channels["acceleration"].values[0] == pytest.approx(-13022 * scale)


# The grid


def test_rounding_does_not_add_up():
    time = np.round(np.arange(360_000) / 64, 4)
    interval, uniform = grid(time)
    assert interval == pytest.approx(1 / 64, rel=1e-9)
    assert uniform


def test_a_drifting_clock_is_not_uniform():
    time = np.arange(1000) * 0.01 * (1 + 1e-4 * np.arange(1000))
    interval, uniform = grid(time)
    assert not uniform
    assert interval == np.median(np.diff(time))


def test_jitter_is_not_uniform():
    time = np.arange(100) * 0.01
    time[50] += 0.0003
    assert grid(time) == (pytest.approx(0.01), False)


def test_gaps_of_whole_intervals_keep_the_grid():
    time = np.delete(np.arange(1000) * 0.01, [5, 6, 7, 500])
    assert grid(time) == (pytest.approx(0.01, rel=1e-12), True)


def made(bench, records) -> Spec:
    return Spec.model_construct(records=records, sensors=bench.sensors, path=bench.folder)
