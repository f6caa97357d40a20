import time
from pathlib import Path

import numpy as np
import pytest

from rigid.io.errors import InputError
from rigid.records.files import load, parse

HEADER = (
    '"TOA5","Rig","CR6","2611","CR6.Std.07","CPU:Rig.CR6","41873","Fast"\n'
    '"TIMESTAMP","RECORD","Load","Press"\n"TS","RN","kN","bar"\n"","","Smp","Smp"\n'
)


def table(text: str):
    return parse(Path("x"), text.encode("utf-8"))


def refusal(content: bytes | str) -> str:
    with pytest.raises(InputError) as caught:
        parse(Path("x"), content.encode() if isinstance(content, str) else content)
    return str(caught.value)


# TOA5


def test_toa5_example(shared):
    found = load(shared / "toa5" / "pytoa5_Example.dat").table
    assert found.columns["TIMESTAMP"].tolist() == [0.0, 86400.0]
    assert found.columns["BattV_Min"].tolist() == [12.99, 12.96]
    assert found.rows.tolist() == [5, 6]


def test_toa5_hourly(shared):
    found = load(shared / "toa5" / "pytoa5_TestLogger_Hourly_1.dat").table
    assert found.columns["TIMESTAMP"].tolist() == [0.0, 3600.0, 7200.0]
    assert found.columns["RelHumid_Avg(3)"].tolist() == [49.31, 54.85, 63.28]


BAD = {
    "04": "line 1 begins with 'TOA6'",
    "05": "line 1 has 9 fields where TOA5 has 8",
    "06": "ends before line 3",
    "07": "ends before line 2",
    "08": "line 2 (names) breaks off inside quotes",
    "09": "line 3 (units) breaks off inside quotes",
}


@pytest.mark.parametrize("number", BAD)
def test_toa5_damaged_headers(number, shared):
    with pytest.raises(InputError) as caught:
        load(shared / "toa5" / f"pytoa5_Bad{number}.dat")
    assert BAD[number] in str(caught.value)
    assert f"Bad{number}.dat: " in str(caught.value)


def test_toa5_fractions_drop_zeros():
    stamps = ["10:00:59.9", "10:00:59.95", "10:01:00", "10:01:00.05", "10:01:00.100001"]
    rows = "".join(f'"2024-01-01 {s}",{k},1,2\n' for k, s in enumerate(stamps))
    found = table(HEADER + rows).columns["TIMESTAMP"]
    assert found.tolist() == [0.0, 0.05, 0.1, 0.15, 0.200001]


def test_toa5_nan_and_restarting_numbers():
    rows = '"2024-01-01 10:00:00",77,"NAN",1\n"2024-01-01 10:00:01",0,2,NAN\n'
    found = table(HEADER + rows)
    assert np.isnan(found.columns["Load"]).tolist() == [True, False]
    assert np.isnan(found.columns["Press"]).tolist() == [False, True]
    assert found.columns["RECORD"].tolist() == [77.0, 0.0]


def test_units_toa5_states():
    found = table(HEADER + '"2024-01-01 10:00:00",0,1,2\n')
    assert found.units == {"Load": "kN", "Press": "bar"}


def test_toa5_repeated_rows_are_dropped():
    row = '"2024-01-01 10:00:0{0}",{0},1,2\n'
    found = table(HEADER + "".join(row.format(k) for k in (0, 1, 1, 2, 0)))
    assert found.columns["TIMESTAMP"].tolist() == [0.0, 1.0, 2.0]
    assert found.rows.tolist() == [5, 6, 8]
    assert found.notes == (
        "2 rows that repeat an earlier row exactly were dropped, the first in line 7",
    )


def test_toa5_header_of_unequal_length():
    assert "line 3 (units) has 3 fields where line 2 names 4" in refusal(
        HEADER.replace('"RN",', "") + '"2024-01-01 10:00:00",0,1,2\n'
    )


def test_toa5_without_rows():
    assert "no data rows" in refusal(HEADER)


def test_toa5_cell_that_is_no_stamp():
    rows = '"2024-01-01 10:00:00",0,1,2\n"01/01/2024 10:00",1,1,2\n'
    assert dict(table(HEADER + rows).refused) == {"TIMESTAMP": "line 6 holds '01/01/2024 10:00'"}


@pytest.mark.slow
def test_an_hour_at_100_hz_is_read_in_seconds():
    start = np.datetime64("2024-01-01T10:00:00", "us")
    rows = []
    for k in range(360_000):
        stamp = str(start + np.timedelta64(10_000 * k, "us")).replace("T", " ")
        stamp = stamp.rstrip("0").rstrip(".") if k % 100 else stamp[:19]
        rows.append(f'"{stamp}",{k},{0.1 * k:.2f},{0.3 * k:.3f}\n')
    content = (HEADER + "".join(rows)).encode()
    began = time.perf_counter()
    found = parse(Path("x"), content)
    assert time.perf_counter() - began < 10.0  # 2 s where nothing else runs
    np.testing.assert_array_equal(found.columns["TIMESTAMP"], np.arange(360_000) / 100)


# Accelerometer


def test_accelerometer_sample(shared):
    found = load(shared / "accelerometer" / "gcdc-x2-2.csv").table
    assert list(found.columns) == ["time", "Ax", "Ay", "Az"]
    assert [c[0] for c in found.columns.values()] == [0.337310, -20.0, -190.0, -13022.0]
    assert [c[-1] for c in found.columns.values()] == [21.821563, 6276.0, 8972.0, -7184.0]
    assert found.rows[0] == 10


def test_accelerometer_comments_anywhere():
    text = ";Title, x\n;Headers, time,Ax\n0.0,-1\n;Start_time, again\n0.1,2\n; stopped\n"
    found = table(text)
    assert found.columns["Ax"].tolist() == [-1.0, 2.0]
    assert found.rows.tolist() == [3, 5]


def test_accelerometer_without_names():
    assert "no line begins with ';Headers,'" in refusal(";Title, x\n;Gain, high\n0.0,-1\n")


def test_a_semicolon_table_with_an_empty_first_name_is_no_accelerometer():
    assert list(table(";load\n0;1\n1;2\n").columns) == ["(column 1)", "load"]
