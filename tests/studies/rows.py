"""Rows of a study on disk, one line a campaign, so that it goes on where it was stopped."""

import ctypes
import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

MAPS, STATM = Path("/proc/self/maps"), Path("/proc/self/statm")
MOST_MAPS = 50_000
"""Mapped regions of memory beyond which compiled programs are let go; Linux grants 65,530, and a
process that has compiled for some forty campaigns of unlike records comes to its end there."""
MOST_MEMORY = 4 << 30
"""Bytes by which a process may grow before they are let go: two that had run some forty campaigns
each held 8 and 9 GB, and one was killed."""


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


def resident() -> int:
    """Bytes of memory that the process holds; 0 where that is not told."""
    return int(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if STATM.exists() else 0


def shed(held: int) -> bool:
    """Let go of compiled programs where they fill the room for them; say whether it was so.

    - `held`: bytes of memory that the process held when it had none.
    """
    crowded = MAPS.exists() and MAPS.read_bytes().count(b"\n") >= MOST_MAPS
    if not crowded and resident() - held < MOST_MEMORY:
        return False
    import jax

    jax.clear_caches()
    give_back()
    return True


def give_back() -> None:
    """Hand memory that is free back to the system, where the C library can.

    It keeps what it has had otherwise: a process of 1.0 GB that lets go of its programs holds as
    much after that, and 0.3 GB after this.
    """
    gc.collect()
    if STATM.exists():
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


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
