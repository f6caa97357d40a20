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
    """What became of an input: "taken", "refused", or a fault in words; and the seconds it took."""

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
        lambda b: b"",
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


@cache
def texts() -> dict[str, bytes]:
    """What is damaged, by subject."""
    data = ROOT / "data" / "reference"
    logger, recorder = head(data / "frame-1.dat"), head(data / "release-1.csv")
    plain = b"t,x,F\n" + b"".join(b"%.2f,%.4f,%d\n" % (i / 100, i / 500, 3 * i) for i in range(99))
    named = {"TOA5": logger, "recorder": recorder, "CSV": plain}
    return {
        "spec": SPEC.read_bytes(),
        **{f"table, {name}": text for name, text in named.items()},
        "record, TOA5": logger,
        "record, recorder": recorder,
    }


@cache
def calibration():
    """The spec whose records the damaged files are read as."""
    return load_spec(SPEC)


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
    kind = "frame" if subject.endswith("TOA5") else "release"
    spec = calibration()
    one = next(r for r in spec.records if r.kind == kind)
    read_record(one.model_copy(update={"file": path}), spec.sensors)
    return "taken"


def outcome(subject: str, seed: int, folder: Path) -> Outcome:
    """Damage a subject by a seed and have it read."""
    rng = np.random.default_rng([sorted(texts()).index(subject), seed])
    return tried(subject, damaged(rng, texts()[subject]), folder)


def tried(subject: str, content: bytes, folder: Path) -> Outcome:
    """Have bytes read; what is neither taken nor refused in a sentence is a fault."""
    began = time.perf_counter()
    try:
        what = taken(subject, content, folder)
    except InputError as refusal:
        what = "refused" if is_sentence(str(refusal), folder) else f"no sentence: {refusal}"[:300]
    except Exception as error:  # whatever else comes is what is looked for
        what = f"{type(error).__name__}: {error}"[:300]
    return Outcome(what, time.perf_counter() - began)


def is_sentence(text: str, folder: Path) -> bool:
    """Whether every line says in which file, and what, at no great length."""
    rows = text.splitlines()
    return bool(rows) and all(20 < len(row) < LONGEST_LINE for row in rows) and str(folder) in text
