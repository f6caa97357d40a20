"""Rows of a study on disk, one line a campaign, so that it goes on where it was stopped."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

MAPS = Path("/proc/self/maps")
MOST_MAPS = 50_000
"""Mapped regions of memory beyond which compiled programs are let go; Linux grants 65,530, and a
process that has compiled for some forty campaigns of unlike records comes to its end there."""


def commit() -> str:
    """Name of the code that runs."""
    told = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    return told.stdout.strip()


def lines_of(paths: Iterable[Path]) -> list[dict]:
    """Rows of the files that are there."""
    rows = []
    for path in paths:
        if path.exists():
            rows += [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    return rows


def shed() -> bool:
    """Let go of compiled programs where they fill the room for them; say whether it was so."""
    if not MAPS.exists() or MAPS.read_bytes().count(b"\n") < MOST_MAPS:
        return False
    import jax

    jax.clear_caches()
    return True


def carry_out(
    path: Path, cases: Iterable[Any], one: Callable[[Any], dict], says: Callable[[dict], object]
) -> None:
    """Append the row of every case that has none yet; `says`: what of a row is told meanwhile.

    - `cases`: named tuples with a `number`.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    done, code = {row["case"]["number"] for row in lines_of([path])}, commit()
    for case in cases:
        if case.number in done:
            continue
        row = one(case) | {"commit": code}
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        sys.stderr.write(f"campaign {case.number}, {case[1:]}: {says(row)}\n")
        shed()
