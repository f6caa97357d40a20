"""`rigid new`: what it guesses of logger files, and that what it writes is a spec."""

import shutil
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid.io.errors import InputError
from rigid.kinds import KINDS
from rigid.new import main
from rigid.records import read_records
from rigid.records.starter import starter
from rigid.spec import load_spec

MEASURED = Path(__file__).resolve().parents[1] / "docs" / "tutorial" / "measured"
ROWS = "".join(f"{k / 100},{k},{k / 10},{k / 7},x\n" for k in range(40))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def tables(path="my-rig.toml"):
    return tomllib.loads(Path(path).read_text("utf-8"))["records"]


def test_the_tutorials_files_are_understood(folder, capsys):
    """All columns and units of the tutorial's own spec, but for those that no file states."""
    assert main([str(MEASURED / name) for name in ("squeeze.txt", "stroll.dat", "snap.csv")]) == 0
    own = tomllib.loads((MEASURED.parent / "my-rig.toml").read_text("utf-8"))["records"]
    found = tables()
    assert [r["name"] for r in found] == [r["name"] for r in own]
    assert [r["channels"] for r in found[:3]] == [r["channels"] for r in own[:3]]
    assert [r["cylinder"] for r in found] == ["A", "1", "2", "A"]
    assert [(folder / r["file"]).resolve() for r in found][::3] == [
        MEASURED / "squeeze.txt",
        MEASURED / "snap.csv",
    ]
    # The unit of an acceleration and of its time is not in the file: told, not guessed.
    assert found[3] == {
        "name": "snap",
        "kind": "release",
        "cylinder": "A",
        "file": found[3]["file"],
        "channels": {},
    }
    says = capsys.readouterr().out
    assert "'squeeze' kind: is missing; it is one of frame, release" in says
    for needed in ("an entry 'time'", "an entry 'acceleration'", "its preload, as in"):
        assert needed in says


def test_a_filled_spec_reads_its_records(folder):
    """With the kind given and what was asked for written in, the records are read."""
    shutil.copy(MEASURED / "squeeze.txt", folder)
    assert main(["squeeze.txt", "--kind", "squeeze=frame", "--out", "a.toml"]) == 0
    text = (folder / "a.toml").read_text("utf-8")
    valve = '[{ until = 2.53, position = "open" }, { position = "shut" }]'
    (folder / "a.toml").write_text(text.replace("valve = []", f"valve = {valve}"), "utf-8")
    (record,) = read_records(load_spec(folder / "a.toml"))
    assert {q: c.unit for q, c in record.channels.items()} == {
        "load": "N",
        "stroke": "cm",
        "pressure": "MPa",
    }


@pytest.mark.parametrize(
    ("header", "channels"),
    [
        ("time [s],Load_A [kN],Stroke_mm,p_MPa,note", "time load stroke pressure"),
        ("t_s,Force (lbf),pos in,Press_psi,note", "time load stroke pressure"),
        ("t/ms,F / kN,Weg/mm,p/bar,note", "time load stroke pressure"),  # as ISO 80000 writes it
        ("time_s,Load_mm,Stroke [bar],p_MPa,note", "time pressure"),  # names against units
        ("T1 (s),Load_A_kN,Stroke_A [mm],Time_of_day,note", "time load stroke"),  # one cylinder
        ("time_s,Load,Stroke_mm_cm,what,note", "time"),  # no unit, two units, no word
    ],
)
def test_names_and_units(folder, header, channels):
    (folder / "free-run.csv").write_text(f"{header}\n{ROWS}", "utf-8")
    assert main(["free-run.csv"]) == 0
    (record,) = tables()
    assert record["kind"] == "free-run"
    assert list(record["channels"]) == channels.split()
    named = header.split(",")
    text = (folder / "my-rig.toml").read_text("utf-8")
    assert all(name in text for name in named)  # none is passed over in silence


def test_both_cylinders_of_a_file_have_a_record_each(folder):
    header = "time [s];Load_A_kN;Load_B_kN;Stroke left [mm];p"
    (folder / "field.csv").write_text(f"{header}\n{ROWS}".replace(",", ";"), "utf-8")
    assert main(["field.csv"]) == 0
    columns = {r["cylinder"]: [c["column"] for c in r["channels"].values()] for r in tables()}
    assert columns == {
        "A": ["time [s]", "Load_A_kN"],
        "B": ["time [s]", "Load_B_kN"],
        "left": ["time [s]", "Stroke left [mm]"],
    }


def test_a_side_may_stand_before_the_quantity(folder):
    header = "time [s],left load [kN],left travel [mm],right load [kN],note"
    (folder / "field.csv").write_text(f"{header}\n{ROWS}", "utf-8")
    assert main(["field.csv"]) == 0
    assert {r["cylinder"]: list(r["channels"]) for r in tables()} == {
        "left": ["time", "load", "stroke"],
        "right": ["time", "load"],
    }


def test_one_cylinder_is_one_name_and_friction_has_memory_beside_a_release(folder):
    """In files of one's own: a spreadsheet's title, minutes, inches, psi, and left and right."""
    header = "elapsed (min);force L (lbf);travel L (in);oil L (psi);travel R (in)"
    rows = "".join(f"{k};{k};{k / 10};{k / 7};{k / 9}\n" for k in range(40)).replace(".", ",")
    (folder / "free-run.csv").write_text(f"Idle stroke;;;;\n{header}\n{rows}", "utf-8")
    (folder / "shot.txt").write_text("Sekunde;az\n" + "0,1;2\n" * 40, "utf-8")
    for files, memory in ((["free-run.csv"], False), (["free-run.csv", "shot.txt"], True)):
        assert main([*files, "--force", "--kind", "free-run=free-run"]) == 0
        text = (folder / "my-rig.toml").read_text("utf-8")
        effects = tomllib.loads(text)["model"]["effects"]
        assert ("frequency-dependent-friction" in effects) is memory
    assert {r["cylinder"]: list(r["channels"]) for r in tables()} == {
        "L": ["time", "load", "stroke", "pressure"],
        "R": ["time", "stroke"],
        "A": [],
    }
    assert "# no column names one" in text
    assert '# time = { column = "Sekunde"' in text


def test_names_that_toml_must_quote(folder):
    name = 'p "in" \\ \x7f'
    (folder / "field [1].csv").write_text(
        f'time_s;Load_kN;"{name.replace(chr(34), chr(34) * 2)}"\n'
        + "".join(f"{k / 100};{k};{k}\n" for k in range(40)),
        "utf-8",
    )
    assert main(["field [1].csv"]) == 0
    (record,) = tables()
    assert (record["name"], record["kind"], record["file"]) == ("field-1", "field", "field [1].csv")


def test_what_is_there_stays(folder, capsys):
    shutil.copy(MEASURED / "squeeze.txt", folder)
    (folder / "my-rig.toml").write_text("mine", "utf-8")
    assert main(["squeeze.txt"]) == 2
    assert "--force" in capsys.readouterr().err
    assert (folder / "my-rig.toml").read_text("utf-8") == "mine"
    assert main(["squeeze.txt", "--force"]) == 0
    assert tables()


def test_all_that_is_wrong_is_told_and_nothing_written(folder, capsys):
    (folder / "empty.csv").write_text("", "utf-8")
    shutil.copy(MEASURED / "squeeze.txt", folder)
    given = ["empty.csv", "squeeze.txt", "gone.csv"]
    assert main([*given, "--kind", "squeze=frame", "--kind", "empty=fram"]) == 2
    said = capsys.readouterr().err
    assert "empty.csv: the file is empty" in said
    assert "gone.csv: there is no such file; name files of your loggers" in said
    assert "unknown record 'squeze'; did you mean 'squeeze'" in said
    assert "unknown kind 'fram'; did you mean 'frame'" in said
    assert not (folder / "my-rig.toml").exists()


def test_a_channel_that_its_kind_does_not_take_is_left_out(folder):
    (folder / "cart.csv").write_text(f"t_s,F_N,x_m,a_g,note\n{ROWS}", "utf-8")
    assert main(["cart.csv", "--kind", "cart=motion"]) == 0
    assert list(tables()[0]["channels"]) == ["time", "force", "position"]
    assert "a motion takes no acceleration" in (folder / "my-rig.toml").read_text("utf-8")


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    names=st.lists(st.text(max_size=12), min_size=2, max_size=4),
    stem=st.text("ab .'#\"[]é=,", max_size=6),
)
def test_whatever_columns_and_files_are_called_the_spec_is_toml(names, stem):
    with TemporaryDirectory() as place:
        path, out = Path(place) / f"n{stem}.csv", Path(place) / "out.toml"
        cells = ['"' + name.replace('"', '""') + '"' for name in names]
        rows = [";".join(str(k + n / 8) for n in range(len(names))) for k in range(3)]
        path.write_text("\n".join([";".join(cells), *rows, ""]), "utf-8")
        try:
            text = starter([path], {}, out)
        except InputError:  # a header that is none, or line breaks in it
            return
        (record,) = tomllib.loads(text)["records"][:1]
        assert (out.parent / record["file"]).resolve() == path.resolve()


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_parses_and_says_what_it_needs(folder, kind, capsys):
    (folder / "one.csv").write_text(f"t_s,F_kN,s_mm,p_bar,note\n{ROWS}", "utf-8")
    assert main(["one.csv", "--kind", f"one={kind}"]) == 0
    assert tables()[0]["kind"] == kind
    assert "still to be filled in" in capsys.readouterr().out  # a valve, a preload, or a sheet
