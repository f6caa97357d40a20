"""Rows of finished jobs on disk, one line each, so that a run goes on where it was stopped."""

import hashlib
import json
import os
import sys
from pathlib import Path
from shutil import copyfile

from rigid.io.files import replacing, write_fault

DIGEST = "sha256"
"""Key of a line for the SHA-256 of its row."""


def read_rows(path: Path) -> list[dict]:
    """Rows of a file, none where there is no file; damaged and unfinished lines give none."""
    return [row for line in _lines(path) if (row := _row(line)) is not None]


def begin(path: Path, keep: bool) -> None:
    """Make a file ready for rows; what it holds stays or goes.

    Damaged lines are told and taken out; the file as it was is set aside.

    Raises EnvironmentFaultError where it cannot be written.
    """
    lines = _lines(path) if keep else []
    whole = [line for line in lines if _row(line) is not None]
    try:
        if len(whole) < len(lines):
            aside = path.with_name(f"{path.name}.damaged")
            copyfile(path, aside)
            sys.stderr.write(
                f"{path}: {len(lines) - len(whole)} damaged line(s), whose jobs are done again; "
                f"the file as it was is set aside as {aside.name}\n"
            )
        with replacing(path) as temporary:
            temporary.write_bytes(b"".join(line + b"\n" for line in whole))
    except OSError as error:
        raise write_fault(path, error) from error


def append(path: Path, row: dict) -> None:
    """Put a row at the end of a file and on the disk itself.

    Raises EnvironmentFaultError where it cannot be written.
    """
    line = json.dumps(row | {DIGEST: _digest(row)}, allow_nan=False)
    try:
        with path.open("ab") as file:
            file.write(line.encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise write_fault(path, error) from error


def _lines(path: Path) -> list[bytes]:
    """Lines of a file that were written to their end."""
    if not path.exists():
        return []
    return path.read_bytes().rpartition(b"\n")[0].splitlines()


def _row(line: bytes) -> dict | None:
    """The row of a line, None where it is damaged; rows of before had no digest."""
    try:
        row = json.loads(line)
        told = row.pop(DIGEST, None)
    except (ValueError, AttributeError):
        return None
    return row if told is None or told == _digest(row) else None


def _digest(row: dict) -> str:
    return hashlib.sha256(json.dumps(row).encode()).hexdigest()
