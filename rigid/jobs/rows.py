"""Rows of finished jobs on disk, one line each, so that a run goes on where it was stopped."""

import json
import os
from pathlib import Path

from rigid.io.files import write_fault


def read_rows(path: Path) -> list[dict]:
    """Rows of a file, none where there is no file; of a row that was cut short, nothing."""
    if not path.exists():
        return []
    whole = path.read_bytes().rpartition(b"\n")[0]
    return [json.loads(line) for line in whole.splitlines()]


def begin(path: Path, keep: bool) -> None:
    """Make a file ready for rows; what it holds stays, whole rows of it, or goes.

    Raises EnvironmentFaultError where it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab") as file:
            size = len(path.read_bytes().rpartition(b"\n")[0])
            file.truncate(size + 1 if keep and size else 0)
    except OSError as error:
        raise write_fault(path, error) from error


def append(path: Path, row: dict) -> None:
    """Put a row at the end of a file and on the disk itself.

    Raises EnvironmentFaultError where it cannot be written.
    """
    try:
        with path.open("ab") as file:
            file.write(json.dumps(row, allow_nan=False).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise write_fault(path, error) from error
