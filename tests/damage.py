"""Specs and record files damaged at random, and whether what reads them says so in a sentence.

An input is a subject and a seed: the same two give the same bytes.
"""

import re
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rigid.io.errors import InputError
from rigid.records import read_record
from rigid.records.files import parse
from rigid.spec import load_spec, parse_spec

ROOT = Path(__file__).parents[1]
SPEC = ROOT / "fits" / "calibration.toml"
LINES = 300
NUMBER = re.compile(rb"-?\d+\.?\d*(?:e-?\d+)?")
TOKENS = (
    b"1e300", b"-1e300", b"1e-320", b"-1", b"0", b"nan", b"inf", b"-inf", b"true", b'""', b"[]",
    b"{}", b"0x10", b"1_0", b"1e", b"--1", b"1,5", b"2018-03-12", b"9" * 400, b"9" * 5000, b"NAN",
    b"\xd9\xa3", b"1 000", b"+7", b"[[", b"'''",
)  # fmt: skip
LONGEST_LINE = 4000
"""Letters of a line of a message, at most: a sentence and what was found."""


class Outcome(NamedTuple):
    """What became of an input: "taken", "refused", or a fault in words; and the seconds of the
    processor that it took."""

    what: str
    seconds: float


def number(rng: np.random.Generator, content: bytes) -> bytes:
    """Put something else in the place of a number."""
    found = list(NUMBER.finditer(content))
    if not found:
        return content
    one = found[rng.integers(len(found))]
    return content[: one.start()] + TOKENS[rng.integers(len(TOKENS))] + content[one.end() :]


def lines(rng: np.random.Generator, content: bytes) -> bytes:
    """Leave lines out, write one twice, or let two change places."""
    rows = content.splitlines(keepends=True)
    if len(rows) < 3:
        return content
    i, j = sorted(rng.integers(len(rows), size=2))
    way = rng.integers(4)
    if way == 0:
        return b"".join(rows[:i] + rows[j:])
    if way == 1:
        return b"".join(rows[:i] + [rows[i]] * int(rng.integers(2, 50)) + rows[i:])
    if way == 2:
        rows[i], rows[j] = rows[j], rows[i]
        return b"".join(rows)
    return b"".join(rows[: i + 1])


def span(rng: np.random.Generator, content: bytes) -> bytes:
    """Put random bytes in the place of some, or none."""
    i = int(rng.integers(len(content) + 1))
    gone, come = rng.integers(40, size=2)
    return content[:i] + rng.bytes(int(come)) + content[i + int(gone) :]


def letter(rng: np.random.Generator, content: bytes) -> bytes:
    """Change one byte, within ASCII."""
    if not content:
        return content
    i = int(rng.integers(len(content)))
    return content[:i] + bytes([int(rng.integers(32, 127))]) + content[i + 1 :]


def whole(rng: np.random.Generator, content: bytes) -> bytes:
    """Write the file as another program would, or break it off."""
    ways: tuple[Callable[[bytes], bytes], ...] = (
        lambda b: b.replace(b",", b";"),
        lambda b: b.replace(b".", b","),
        lambda b: b.replace(b"\n", b"\r\n"),
        lambda b: b.replace(b"\n", b"\r"),
        lambda b: b"\xef\xbb\xbf" + b,
        lambda b: b.decode("latin-1").encode("utf-16"),
        lambda b: b.replace(b'"', b""),
        lambda b: b"A title\n" + b,
        lambda b: b[:0],
        lambda b: b[: int(rng.integers(len(b) + 1))],
        lambda b: b + b,
        lambda b: b.upper(),
    )
    return ways[rng.integers(len(ways))](content)


def noise(rng: np.random.Generator, content: bytes) -> bytes:
    """Bytes that never were a file."""
    return rng.bytes(int(rng.integers(1, len(content) + 2)))


WAYS = (number, lines, span, letter, whole)


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """Damage a file in one to four ways; one in fifty is noise from end to end."""
    if rng.random() < 0.02:
        return noise(rng, content)
    for _ in range(int(rng.integers(1, 5))):
        content = WAYS[rng.choice(len(WAYS), p=(0.35, 0.2, 0.2, 0.15, 0.1))](rng, content)
    return content


def head(path: Path) -> bytes:
    """First lines of a file."""
    return b"".join(path.read_bytes().splitlines(keepends=True)[:LINES])


RECORDS = """\
[model]
effects = ["load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve"]

[sensors]
force = { noise = 2.0, gain_sd = 0.01, zero_sd = 1.0 }

[[records]]
name = "semicolons"
kind = "free-run"
file = "input"
valve = [{ until = 8.0, position = "open" }, { position = "shut" }]
[records.channels]
time = { column = "time [s]", unit = "s" }
stroke = { column = "way", unit = "cm" }
pressure = { column = 3, unit = "bar", offset = -0.4e5 }

[[records]]
name = "tabs"
kind = "frame"
file = "input"
[records.channels]
time = { column = 1, unit = "ms" }
load = { column = 2, unit = "counts", scale = 0.5 }
pressure = { column = 3, unit = "psi" }

[[records]]
name = "field"
kind = "field"
file = "input"
[records.channels]
time = { column = "TIMESTAMP", unit = "timestamp" }
load = { column = "Load_B", unit = "kN" }
stroke = { column = "Stroke_B", unit = "mm" }
pressure = { column = "Press_B", unit = "bar" }

[[records]]
name = "motion"
kind = "motion"
file = "input"
corner = 20.0
accept = ["gap", "nan", "unit", "time-not-increasing"]
[records.channels]
time = { column = "t", unit = "s" }
position = { column = "x", unit = "m" }
force = { column = "F", unit = "N" }
"""
"""Records of a rig and of a machine: no spec to fit, each is read alone."""


@cache
def texts() -> dict[str, bytes]:
    """What is damaged, by subject."""
    data = ROOT / "data" / "reference"
    logger, recorder = head(data / "frame-1.dat"), head(data / "release-1.csv")
    times = np.arange(LINES) / 100
    plain = "t,x,F\n" + "".join(f"{t:.2f},{t**2:.4f},{3 * t:.2f}\n" for t in times)
    german = "time [s];way;Druck\n;cm;bar\n" + "".join(
        f"{t:.2f};{t:.3f};{50 + 3 * t:.2f}\n".replace(".", ",") for t in times
    )
    bare = "# Zeit\tKraft\tp\n" + "".join(
        f"{1e3 * t:.0f}\t{9e3 * t:.0f}\t{500 * t:.1f}\n" for t in times
    )
    return {
        "spec": SPEC.read_bytes(),
        "table, TOA5": logger,
        "table, recorder": recorder,
        "table, CSV": plain.encode(),
        "table, semicolons": german.encode(),
        "record, TOA5": logger,
        "record, recorder": recorder,
        "record, semicolons": german.encode("latin-1"),
        "record, tabs": bare.encode(),
        "record, field": head(data / "field-1.dat"),
        "record, motion": plain.encode(),
    }


@cache
def records() -> dict:
    """What the damaged records are read as, by subject."""
    kinds = {"frame": "TOA5", "release": "recorder"}
    own = parse_spec(RECORDS, ROOT / "own.toml")
    found = {f"record, {one.name}": (one, own.sensors) for one in own.records}
    spec = load_spec(SPEC)
    for one in reversed(spec.records):  # the first of each kind remains
        if one.kind in kinds:
            found[f"record, {kinds[one.kind]}"] = (one, spec.sensors)
    return found


def taken(subject: str, content: bytes, folder: Path) -> str:
    """Have an input read as its subject is."""
    path = folder / "input"
    if subject == "spec":
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            path.write_bytes(content)
            load_spec(path)
            return "taken"
        parse_spec(text, path)
        return "taken"
    if subject.startswith("table"):
        parse(path, content)
        return "taken"
    path.write_bytes(content)
    one, sensors = records()[subject]
    read_record(one.model_copy(update={"file": path}), sensors)
    return "taken"


def outcome(subject: str, seed: int, folder: Path) -> Outcome:
    """Damage a subject by a seed and have it read."""
    rng = np.random.default_rng([sorted(texts()).index(subject), seed])
    return tried(subject, damaged(rng, texts()[subject]), folder)


def tried(subject: str, content: bytes, folder: Path) -> Outcome:
    """Have bytes read; what is neither taken nor refused in a sentence is a fault."""
    began = time.process_time()
    try:
        what = taken(subject, content, folder)
    except InputError as refusal:
        what = "refused" if is_sentence(str(refusal), folder) else f"no sentence: {refusal}"[:300]
    except Exception as error:  # whatever else comes is what is looked for
        what = f"{type(error).__name__}: {error}"[:300]
    return Outcome(what, time.process_time() - began)


def is_sentence(text: str, folder: Path) -> bool:
    """Whether every line says in which file, and what, at no great length."""
    rows = text.splitlines()
    return bool(rows) and all(20 < len(row) < LONGEST_LINE for row in rows) and str(folder) in text
