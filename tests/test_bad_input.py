"""What cannot be taken is refused with one sentence that says where, what and what to do."""

import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import h5py
import numpy as np
import pytest

import rigid
from rigid import fit
from rigid.inference.posterior import load_posterior
from rigid.io import files
from rigid.io.errors import InputError, quoted
from rigid.io.hdf5 import require_own
from rigid.records import read_record
from rigid.records.files import load
from rigid.spec import load_spec, parse_spec

MOTION = """
[[records]]
name = "to-and-fro"
kind = "motion"
file = "cart.csv"
corner = 20.0
channels.time = { column = "t", unit = "s" }
channels.position = { column = "x", unit = "m" }
channels.force = { column = "F", unit = "N" }
"""
SENSORS = """
[sensors]
force = { noise = 2.0, gain_sd = 0.01, zero_sd = 1.0 }
"""


def refused(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_spec(text, Path("my.toml"))
    return str(caught.value)


def within_seconds(work, *given):
    """Run what might hang in a thread; it has to raise InputError."""
    out = []

    def one():
        try:
            work(*given)
        except InputError as error:
            out.append(str(error))

    thread = threading.Thread(target=one, daemon=True)
    thread.start()
    thread.join(10.0)
    assert not thread.is_alive(), "still waiting"
    return out[0]


def special_files(folder: Path):
    os.mkfifo(folder / "pipe")
    with socket.socket(socket.AF_UNIX) as held:
        here = Path.cwd()
        os.chdir(folder)  # the name of a socket may have some hundred characters alone
        held.bind("socket")
        os.chdir(here)
    return {
        folder / "pipe": "a pipe",
        Path("/dev/zero"): "a device",
        folder: "a folder",
    }


@pytest.mark.parametrize("read", [load, load_spec], ids=["record", "spec"])
def test_what_is_no_regular_file_is_refused_at_once(read, tmp_path):
    for path, what in special_files(tmp_path).items():
        says = within_seconds(read, path)
        assert says == f"{path}: this is {what}; name a regular file"


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    path = tmp_path / "long.toml"
    with path.open("wb") as file:
        file.truncate(5 * files.MIB)  # a hole: it takes no room
    with pytest.raises(InputError, match=r"has 5 MiB; at most 4 MiB are read"):
        load_spec(path)


@pytest.mark.parametrize("text", ["a = " + "[" * 5000 + "]" * 5000, "a = " + "{b = " * 5000])
def test_what_is_nested_deep_is_a_sentence(text):
    assert "nested too deep" in refused(text)


def recorded(folder: Path, *rows: str) -> str:
    """What is said of a motion with such rows."""
    steady = [f"{k / 100:.2f},{k * k},{k}" for k in range(40)]
    (folder / "cart.csv").write_text("\n".join(["t,x,F", *steady, *rows]) + "\n")
    one = parse_spec(MOTION + SENSORS, folder / "my.toml")
    with pytest.raises(InputError) as caught:
        read_record(one.records[0], one.sensors)
    return str(caught.value)


@pytest.mark.parametrize("reading", ["1e300", "-1e21"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_reading_beyond_every_sensor_names_its_line(reading, place, tmp_path):
    row = ["0.41", "1", "1"]
    row[place] = reading
    says = recorded(tmp_path, ",".join(row))
    assert str(tmp_path / "cart.csv") in says
    assert "line 42" in says
    assert "beyond any reading" in says


def test_a_clock_without_extent_is_refused(tmp_path):
    rows = [f"{1 + k * 1e-15!r},1,1" for k in range(100)]
    assert "the time usually steps by" in recorded(tmp_path, *rows)


def test_what_was_found_is_repeated_in_few_words(tmp_path):
    assert len(recorded(tmp_path, f"0.41,{'x' * 5000},1")) < 500
    many = ",".join(f"column{k}" for k in range(500))
    (tmp_path / "cart.csv").write_text(many + "\n" + ",".join("1" * 500) + "\n")
    one = parse_spec(MOTION + SENSORS, tmp_path / "my.toml")
    with pytest.raises(InputError, match="and 460 more"):
        read_record(one.records[0], one.sensors)
    assert quoted(10**5000) == "a number of thousands of digits"


def test_a_number_of_ten_thousand_digits_is_a_sentence():
    assert "is not valid TOML" in refused("a = " + "9" * 10_000)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("M_HC = 1e300", "1e+30"),
        ("M_HC = 1e29", "must lie between 0.001 and 1e+06 kg; found 1e+29"),
        ("M_Pl = 1e-9", "must lie between 0.001 and 1e+06 kg"),
        ("S_Pl = 44.2", "must lie between 1e-08 and 10 m^2"),  # cm^2 in place of m^2
        ("L_0 = 200.0", "must lie between 0.0001 and 100 m"),  # mm in place of m
        ("k_oil = 2.0", "must lie between 100000 and 1e+12 Pa"),  # GPa in place of Pa
        ("k_oil = { value = 2e9, sd = 3e9 }", "sd must be at most the value itself"),
    ],
)
def test_every_constant_of_the_rig_has_a_physical_range(table, says):
    assert says in refused(f"[rig]\n{table}\n")


def test_a_rig_on_which_nothing_acts_is_refused_and_a_free_body_is_not():
    frame = MOTION.replace("motion", "frame").replace("corner = 20.0\n", "")
    frame = frame.replace("position", "stroke").replace("force", "load")
    says = refused(f"[model]\neffects = []\n{frame}")
    assert "effects is empty, but to-and-fro is a frame of the rig" in says
    assert "load-cell-spring" in says
    assert parse_spec(f"[model]\neffects = []\n{SENSORS}{MOTION}", Path("my.toml"))


OWN = """
from rigid.effects import AbstractEffect
print("ran")
"""


@pytest.mark.slow
def test_code_of_a_specs_own_is_told_first_and_can_be_refused(tmp_path):
    (tmp_path / "mine.py").write_text(OWN, encoding="utf-8")
    spec = tmp_path / "mine.toml"
    spec.write_text(
        f'[model]\neffects = ["viscous-friction", "mine:Damper"]\n{SENSORS}{MOTION}',
        encoding="utf-8",
    )
    command = [sys.executable, "-m", "rigid.check", str(spec), "--quiet"]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.stderr.splitlines()[0] == f"spec {spec} runs code of its own: mine:Damper"
    kept = subprocess.run([*command, "--no-own-code"], capture_output=True, text=True, check=False)
    assert kept.returncode == 2
    assert "runs code of its own (mine:Damper), which --no-own-code refuses" in kept.stderr
    assert "ran" not in kept.stdout
    with pytest.raises(InputError, match="no-own-code"):
        rigid.load(spec, own_code=False)


def test_a_field_record_is_looked_at_before_a_fit(tmp_path, capsys):
    time = np.arange(400) / 100.0
    table = np.column_stack([time, 0.1 * np.sin(time), 40.0 * np.cos(time)])
    np.savetxt(tmp_path / "cart.csv", table, delimiter=",", header="t,x,F", comments="")
    field = """
[[records]]
name = "test"
kind = "field"
file = "not-there.csv"
channels.time = { column = "t", unit = "s" }
channels.load = { column = "F", unit = "N" }
channels.stroke = { column = "x", unit = "m" }
"""
    spec = tmp_path / "both.toml"
    effects = '[model]\neffects = ["viscous-friction"]\n'
    spec.write_text(f"{effects}{SENSORS}{MOTION}{field}", encoding="utf-8")
    assert fit.main([str(spec), "--quiet", "--out", str(tmp_path / "out")]) == 2
    assert "not-there.csv: there is no such file" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def outside(file: h5py.File, way: str, other: Path) -> None:
    if way == "external link":
        file["x"] = h5py.ExternalLink(str(other), "/secret")
    elif way == "soft link":
        file["x"] = h5py.SoftLink("/elsewhere")
    elif way == "external data":
        file.create_dataset("x", (4,), "f8", external=[(str(other), 0, 32)])
    else:
        layout = h5py.VirtualLayout((4,), "f8")
        layout[:] = h5py.VirtualSource(str(other), "secret", (4,))
        file.create_group("deep").create_virtual_dataset("x", layout)


@pytest.mark.parametrize("way", ["external link", "soft link", "external data", "virtual data"])
def test_a_posterior_that_reaches_outside_its_file_is_refused(way, tmp_path):
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["secret"] = np.arange(4.0)
    path = tmp_path / "posterior.nc"
    with h5py.File(path, "w") as file:
        file["posterior/k_LC"] = np.ones(3)
    require_own(path)
    with h5py.File(path, "a") as file:
        outside(file, way, other)
    with pytest.raises(InputError, match="which rigid never writes; the file is refused"):
        load_posterior(path)
