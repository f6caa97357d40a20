import time
from pathlib import Path

import numpy as np
import pytest

from rigid.errors import EnvironmentFaultError, InputError
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


# Plain tables


PLAIN = {
    "comma": "time,load\n0,1.5\n0.1,2.5\n",
    "windows lines": "time,load\r\n0,1.5\r\n0.1,2.5\r\n",
    "old mac lines": "time,load\r0,1.5\r0.1,2.5\r",
    "tab": "time\tload\n0\t1.5\n0.1\t2.5\n",
    "semicolon": "time;load\n0;1.5\n0.1;2.5\n",
    "decimal comma": "time;load\n0;1,5\n0,1;2,5\n",
    "decimal comma, tab": "time\tload\n0\t1,5\n0,1\t2,5\n",
    "quoted": '"time","load"\n"0","1.5"\n"0.1","2.5"\n',
    "spaces": "time, load\n 0, 1.5\n 0.1, 2.5\n",
    "units row": "time,load\ns,kN\n0,1.5\n0.1,2.5\n",
    "units row with gaps": "time,load\n,kN\n0,1.5\n0.1,2.5\n",
    "comments": "# by hand\ntime,load\n0,1.5\n# pause\n0.1,2.5\n",
    "empty lines": "\ntime,load\n\n0,1.5\n0.1,2.5\n\n",
    "trailing separators": "time,load\n0,1.5,\n0.1,2.5,\n",
    "byte-order mark": "\ufefftime,load\n0,1.5\n0.1,2.5\n",
    "no last newline": "time,load\n0,1.5\n0.1,2.5",
    "exponents": "time,load\n0,1.5e0\n1E-1,25e-1\n",
}


@pytest.mark.parametrize("case", PLAIN)
def test_plain_tables(case):
    found = table(PLAIN[case])
    assert list(found.columns) == ["time", "load"]
    np.testing.assert_array_equal(found.columns["time"], [0.0, 0.1])
    np.testing.assert_array_equal(found.columns["load"], [1.5, 2.5])
    assert not found.refused
    lines = PLAIN[case].lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    assert all("5" in lines[row - 1] for row in found.rows)


def test_without_header_columns_are_numbered():
    found = table("0\t1\t2\n0.1\t3\t4\n")
    assert list(found.columns) == ["1", "2", "3"]
    assert found.rows.tolist() == [1, 2]


def test_missing_cells_are_nan():
    found = table("time,load\n0,NAN\n1,\n2,NaN\n3,n/a\n4,5\n")
    assert np.isnan(found.columns["load"]).tolist() == [True] * 4 + [False]


def test_latin_1_names():
    content = "time,Weg µ\n0,1\n1,2\n".encode("latin-1")
    assert "Weg µ" in parse(Path("x"), content).columns


def test_repeated_and_empty_names_get_their_number():
    found = table("time,load,load,\n0,1,2,3\n1,1,2,3\n")
    assert list(found.columns) == ["time", "load (column 2)", "load (column 3)", "(column 4)"]


def test_a_torn_last_row_is_dropped():
    found = table("time,load\n0,1\n1,2\n2")
    assert found.columns["time"].tolist() == [0.0, 1.0]
    assert found.notes == ("line 4, the last, breaks off and was dropped",)


def test_words_spoil_only_their_column():
    found = table("time,load,event\n0,1,start\n1,2,\n2,3,stop\n")
    assert dict(found.refused) == {"event": "line 2 holds 'start'"}
    assert found.columns["load"].tolist() == [1.0, 2.0, 3.0]


def test_time_stamps_in_a_plain_table():
    found = table("when,load\n2024-01-01T10:00:59.5Z,1\n2024-01-01T10:01:00Z,2\n")
    assert found.columns["when"].tolist() == [0.0, 0.5]
    assert found.timestamps == {"when"}


def test_a_time_stamp_that_names_no_moment():
    found = table("when,load\n2024-01-01 10:00:00,1\n2024-02-30 10:00:00,2\n")
    assert dict(found.refused) == {"when": "line 3 holds '2024-02-30 10:00:00'"}


REFUSED = {
    "nothing": ("", "is empty"),
    "blanks": (" \n\n", "is empty"),
    "only a header": ("time,load\n", "no data rows"),
    "only comments": ("# a\n# b\n", "no data rows"),
    "one column": ("time\n0\n1\n", "no columns found"),
    "ragged": ("time,load\n0,1\n1,2,3\n2,3\n", "line 3 has 3 cells where the file has 2"),
    "short row": ("time,load\n0,1\n1\n2,3\n", "line 3 has 1 cells"),
    "bare decimal commas": ("time,load\n0,0,1,5\n0,1,2,5\n", "decimal commas"),
    "quotes": ('time,load\n0,"1\n1,2\n', "quotation marks"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_plain_refusals(case):
    text, says = REFUSED[case]
    assert says in refusal(text)


BINARY = {
    "workbook": (b"PK\x03\x04abc", "export the sheet as CSV"),
    "hdf5": (b"\x89HDF\r\n", "HDF5"),
    "packed": (b"\x1f\x8b\x08", "unpack"),
    "utf-16": ("time,load\n0,1".encode("utf-16"), "save it as UTF-8"),
    "torn": (b"time,load\n0,1\n1,\0\0\0\n", "line 3 holds bytes that are no text"),
    "TOB1": (b'"TOB1","Rig","CR6"\r\n\0\1', "convert it to TOA5"),
    "TOB3": (b'"TOB3","Rig","CR6"\r\n\0\1', "convert it to TOA5"),
}


@pytest.mark.parametrize("case", BINARY)
def test_binary_refusals(case):
    content, says = BINARY[case]
    assert says in refusal(content)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"no\.csv: there is no such file"):
        load(tmp_path / "no.csv")


def test_folder(tmp_path):
    with pytest.raises(InputError, match="this is a folder"):
        load(tmp_path)


def test_unreadable_file(tmp_path, monkeypatch):
    def refuse(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(EnvironmentFaultError, match=r"r\.csv: could not be read \(Permission"):
        load(tmp_path / "r.csv")


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
