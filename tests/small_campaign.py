"""A small campaign in files of someone else's making: other names, units, formats and folders."""

import csv
import json
from pathlib import Path

from rigid.generator import campaign

SPEC = """\
title = "A rig of one's own"
simulated = true

[model]
effects = [
    "load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve",
    "frequency-dependent-friction",
]

[[records]]
name = "squeeze"
kind = "frame"
cylinder = "left"
file = "../measured/day 1/squeeze.txt"
valve = [{valve}]
[records.channels]
time = {{ column = "ms", unit = "ms" }}
load = {{ column = "Kraft", unit = "N" }}
stroke = {{ column = 3, unit = "cm" }}
pressure = {{ column = "Druck", unit = "MPa" }}

[[records]]
name = "stroll"
kind = "free-run"
cylinder = "left"
file = "../measured/day 2/stroll.dat"
valve = [{{ until = {shut}, position = "open" }}, {{ position = "shut" }}]
[records.channels]
time = {{ column = "TIMESTAMP", unit = "timestamp" }}
load = {{ column = "F1", unit = "kN" }}
stroke = {{ column = "s1", unit = "mm" }}
pressure = {{ column = "p1", unit = "bar" }}

[[records]]
name = "stroll"
kind = "free-run"
cylinder = "right"
file = "../measured/day 2/stroll.dat"
valve = [{{ until = {shut}, position = "open" }}, {{ position = "shut" }}]
[records.channels]
time = {{ column = "TIMESTAMP", unit = "timestamp" }}
load = {{ column = "F2", unit = "kN" }}
stroke = {{ column = "s2", unit = "mm" }}
pressure = {{ column = "p2", unit = "bar" }}

[[records]]
name = "snap"
kind = "release"
cylinder = "left"
file = "../measured/day 2/snap.csv"
preload = {{ value = 6000.0, sd = 60.0 }}
[records.channels]
time = {{ column = "t", unit = "s" }}
acceleration = {{ column = "a", unit = "m/s2" }}

[sampler]
seed = 3
ensembles = 2
starts = 4
ess = {ess}
r_hat = {r_hat}
"""
COUNT = 200 * 9.80665 / 32768
OTHERS = (("_A", "1"), ("_B", "2"))
RENAMED = (("Load", "F"), ("Stroke", "s"), ("Press", "p"))


def make(folder: Path, seed: int = 11, ess: float = 200.0, r_hat: float = 1.05) -> dict:
    """Write records below `folder`/measured and `folder`/specs/own.toml; gives the truth."""
    raw = folder / "raw"
    campaign(seed, raw, field=False)
    truth = json.loads((raw / "truth.json").read_text("utf-8"))
    for day in ("day 1", "day 2"):
        (folder / "measured" / day).mkdir(parents=True)
    _squeeze(raw / "frame-1.dat", folder / "measured" / "day 1" / "squeeze.txt")
    _stroll(raw / "free-run-2.dat", folder / "measured" / "day 2" / "stroll.dat")
    _snap(raw / "release-1.csv", folder / "measured" / "day 2" / "snap.csv")
    (folder / "specs").mkdir()
    write_spec(folder, truth, ess, r_hat)
    return truth


def write_spec(folder: Path, truth: dict, ess: float, r_hat: float) -> Path:
    valves = {(r["name"], r["cylinder"]): r["valve"] for r in truth["runs"]}
    entries = [dict(s) for s in valves["frame-1", "A"]]
    entries[-1].pop("until")
    valve = ", ".join(
        "{ " + ", ".join(f"{k} = {json.dumps(v)}" for k, v in e.items()) + " }" for e in entries
    )
    shut = valves["free-run-2", "A"][0]["until"]
    path = folder / "specs" / "own.toml"
    path.write_text(SPEC.format(valve=valve, shut=shut, ess=ess, r_hat=r_hat), "utf-8")
    return path


def _rows(path: Path) -> tuple[list[str], list[list[str]]]:
    lines = list(csv.reader(path.read_text("utf-8").splitlines()))
    return lines[1], lines[4:]


def _squeeze(source: Path, to: Path) -> None:
    """The logger's table as semicolons and decimal commas, in N, cm and MPa."""
    names, rows = _rows(source)
    at = [names.index(n) for n in ("Load_A", "Stroke_A", "Press_A")]
    lines = ["ms;Kraft;Weg;Druck", "ms;N;cm;MPa"]
    for k, row in enumerate(rows):
        load, stroke, pressure = (float(row[i]) for i in at)
        cells = (f"{10 * k}", f"{load * 1e3:.1f}", f"{stroke / 10:.4f}", f"{pressure / 10:.6f}")
        lines.append(";".join(cells).replace(".", ","))
    to.write_text("\n".join(lines) + "\n", "utf-8")


def _stroll(source: Path, to: Path) -> None:
    """The logger's own file, its columns renamed."""
    text = source.read_text("utf-8")
    for old, new in RENAMED:
        for cylinder, number in OTHERS:
            text = text.replace(f'"{old}{cylinder}"', f'"{new}{number}"')
    to.write_text(text, "utf-8")


def _snap(source: Path, to: Path) -> None:
    """The accelerometer's counts as m/s^2."""
    lines = ["t,a"]
    for line in source.read_text("utf-8").splitlines():
        if not line.startswith(";"):
            cells = line.split(",")
            lines.append(f"{cells[0]},{float(cells[3]) * COUNT:.6f}")
    to.write_text("\n".join(lines) + "\n", "utf-8")
