"""Rows of a study on disk, one line a campaign, so that it goes on where it was stopped."""

import datetime
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigid.io.errors import RigidError
from rigid.jobs.memory import resident, shed

DEFECT = RigidError.status
"""Exit status of a command that fails at what it does not expect."""


def commit() -> str:
    """Name of the code that runs; rows that a study has written since are none of it."""
    name = _git("describe", "--always")
    changed = _git("status", "--porcelain", "-uno", "--", ":/", ":(top,exclude)docs/studies")
    return f"{name}-dirty" if changed else name


def committed() -> str:
    """When that code was committed, in UTC; nothing where no commit is known."""
    seconds = _git("log", "-1", "--format=%ct")
    if not seconds:
        return ""
    return datetime.datetime.fromtimestamp(int(seconds), datetime.UTC).isoformat()


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


class OneCode(NamedTuple):
    """Rows that one commit made.

    - date: of the commit; others: how many rows of each other commit were left out.
    """

    rows: Sequence[dict]
    commit: str
    date: str
    others: Mapping[str, int]


def of_one_commit(rows: Sequence[dict], name: str | None = None) -> OneCode:
    """Take the rows of a commit, or of the latest one, and count those left out."""
    dates = {row["commit"]: row.get("date", "") for row in rows}
    if name is None:
        name = max(dates, key=lambda one: dates[one], default="no commit")
    others = Counter(row["commit"] for row in rows if row["commit"] != name)
    kept = [row for row in rows if row["commit"] == name]
    return OneCode(kept, name, dates.get(name, ""), others)


def no_answer(error: Exception, folder: Path) -> dict:
    """What a row holds in place of an answer where a command refused or failed.

    - folder: of the campaign; what was said is kept without it.
    """
    told, status = (
        (str(error), error.status) if isinstance(error, RigidError) else (repr(error), DEFECT)
    )
    says = told.replace(f"{folder}/", "")
    verdict = "refused" if status == 2 else "failed"
    return {"verdict": verdict, "steps": [], "says": says, "status": status}


def carry_out(
    path: Path, cases: Iterable[Any], one: Callable[[Any], dict], says: Callable[[dict], object]
) -> None:
    """Append the row of every case that has none yet; `says`: what of a row is told meanwhile.

    - `cases`: named tuples with a `number`.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    held = resident()
    done = {row["case"]["number"] for row in lines_of([path])}
    code = {"commit": commit(), "date": committed()}
    for case in cases:
        if case.number in done:
            continue
        row = one(case) | code
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        sys.stderr.write(f"campaign {case.number}, {case[1:]}: {says(row)}\n")
        if shed(held):
            held = resident()
