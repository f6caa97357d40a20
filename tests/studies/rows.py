"""Rows of a study on disk, one line a campaign, so that it goes on where it was stopped."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rigid.jobs.memory import resident, shed


def commit() -> str:
    """Name of the code that runs; rows that a study has written since are none of it."""
    name = _git("describe", "--always")
    changed = _git("status", "--porcelain", "-uno", "--", ":/", ":(top,exclude)docs/studies")
    return f"{name}-dirty" if changed else name


def _git(*words: str) -> str:
    told = subprocess.run(["git", *words], capture_output=True, text=True, check=False)
    return told.stdout.strip()


def lines_of(paths: Iterable[Path]) -> list[dict]:
    """Rows of the files that are there."""
    rows = []
    for path in paths:
        if path.exists():
            rows += [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    return rows


def carry_out(
    path: Path, cases: Iterable[Any], one: Callable[[Any], dict], says: Callable[[dict], object]
) -> None:
    """Append the row of every case that has none yet; `says`: what of a row is told meanwhile.

    - `cases`: named tuples with a `number`.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    held = resident()
    done, code = {row["case"]["number"] for row in lines_of([path])}, commit()
    for case in cases:
        if case.number in done:
            continue
        row = one(case) | {"commit": code}
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        sys.stderr.write(f"campaign {case.number}, {case[1:]}: {says(row)}\n")
        if shed(held):
            held = resident()
