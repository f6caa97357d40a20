from pathlib import Path

import numpy as np
import pytest

from rigid.io.errors import EnvironmentFaultError, InputError
from rigid.records.files import load, parse


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
    "sep line": "sep=;\ntime;load\n0;1.5\n0.1;2.5\n",
    "sep line in quotes": '"sep=,"\ntime,load\n0,1.5\n0.1,2.5\n',
    "header behind #": "#time,load\n0,1.5\n0.1,2.5\n",
    "header and units behind #": "# by hand\n# time, load\n# s, kN\n0,1.5\n0.1,2.5\n",
    "header behind #, units not": "#time,load\ns,kN\n0,1.5\n0.1,2.5\n",
    "header ends in a separator": "time,load,\n0,1.5\n0.1,2.5\n",
    "titles": "Frame test, no. 2.5\noperator: AB\ntime\tload\n0\t1.5\n0.1\t2.5\n",
    "a spreadsheet's title": "Frame test, no. 2.5;\n;\ntime;load\n0;1.5\n0.1;2.5\n",
    "a title and units": "Frame test\n\ntime;load\ns;kN\n0;1.5\n0.1;2.5\n",
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


def test_titles_are_told_and_a_header_that_lacks_a_cell_is_none():
    assert table(PLAIN["titles"]).notes == ("lines above the header were passed over: 2",)
    assert table(PLAIN["comma"]).notes == ()
    assert "line 2 has 3 cells" in refusal("time,load\n0,1.5,2\n0.1,2.5,3\n0.2,3.5,4\n")


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


@pytest.mark.parametrize("quote", ["", '"'])
def test_semicolons_in_text_do_not_split(quote):
    rows = "".join(f"{k},{k + 1},{quote}start; {k}{quote}\n" for k in range(3))
    found = table("time,load,comment\n" + rows)
    assert list(found.columns) == ["time", "load", "comment"]
    assert found.columns["load"].tolist() == [1.0, 2.0, 3.0]


def test_sep_line_without_rows():
    assert "no data rows" in refusal("sep=;\n\n")


@pytest.mark.parametrize("more", ["", "x"])
def test_underscores_make_no_numbers(more):
    found = table(f"time,load,event\n0,1_000,{more}\n1,2,3\n")
    assert found.refused["load"] == "line 2 holds '1_000'"


def test_an_empty_name_with_cells_below_stays():
    assert list(table("time,load,\n0,1,\n1,2,3\n").columns) == ["time", "load", "(column 3)"]


STATED = {
    "row": "time,load,t\ns,kN,degC\n0,1,2\n1,2,3\n",
    "row in brackets": "time,load,t\n[s],(kN),[K]\n0,1,2\n1,2,3\n",
    "names": "time [s],load (kN),t [degC]\n0,1,2\n1,2,3\n",
    "behind #": "#time,load,t\n#s,kN,-\n0,1,2\n1,2,3\n",
}


@pytest.mark.parametrize("case", STATED)
def test_units_a_file_states(case):
    found = table(STATED[case])
    assert list(found.units.values()) == ["s", "kN"]
    assert list(found.units) == list(found.columns)[:2]


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
    def refuse(*_given):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("rigid.records.files.read_bytes", refuse)
    with pytest.raises(EnvironmentFaultError, match=r"r\.csv: could not be read \(Permission"):
        load(tmp_path / "r.csv")
