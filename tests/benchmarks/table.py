"""Rows of the benchmark, and the Markdown page that shows them."""

import datetime
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

HEADER = "| what | against | measured | bar | met? |\n|---|---|---|---|---|"
WORDS = {True: "yes", False: "**no**", None: "-"}


@dataclass(frozen=True)
class Row:
    """One line of the table.

    - `what`, `against`: the two sides. - `measured`: the ratio, in words. - `bar`: what is asked.
    - `met`: None where nothing could be measured. - `notes`: how it was measured.
    """

    what: str
    against: str
    measured: str
    bar: str
    met: bool | None
    notes: tuple[str, ...] = ()

    def line(self) -> str:
        return (
            f"| {self.what} | {self.against} | {self.measured} | {self.bar} | {WORDS[self.met]} |"
        )


def ratio_row(sides: tuple[str, str], ratio: float, least: float, *notes: str) -> Row:
    """A row whose bar is a least ratio; a bar of 1 asks for being ahead."""
    bar = f"{least:g} times" if least > 1.0 else "ahead"
    return Row(*sides, f"{ratio:.3g} times", bar, bool(ratio > least), notes)


def missing(sides: tuple[str, str], bar: str, module: str) -> Row:
    """A row for a peer that is not installed."""
    how = f"not run: `{module}` is not installed; `pip install -e .[peers]`"
    return Row(*sides, how, bar, None)


def commit(root: Path) -> str:
    """What git calls the tree that was measured."""
    said = subprocess.run(
        ("git", "describe", "--always", "--dirty"), cwd=root, capture_output=True, text=True
    )
    return said.stdout.strip() or "unknown"


def page(rows: list[Row], provenance: list[str]) -> str:
    """The Markdown of a run: provenance, table, then how each row was measured."""
    lines = ["# Speed, side by side", "", *provenance, "", HEADER, *(r.line() for r in rows), ""]
    for row in rows:
        if row.notes:
            lines += [f"**{row.what}**, against {row.against}:", ""]
            lines += [f"- {note}" for note in row.notes] + [""]
    return "\n".join(lines).rstrip() + "\n"


def provenance(root: Path, command: str, quick: bool, began: datetime.datetime) -> list[str]:
    """Command, commit, date, and how busy the machine was."""
    load = os.getloadavg()[0]
    lines = [
        f"`{command}` at commit {commit(root)}, {began:%Y-%m-%d %H:%M} UTC, {os.cpu_count()} "
        f"cores, load average {load:.1f} at the end.",
        "",
        "The campaign `data/reference` is simulated. Every time is a median of several runs.",
    ]
    if quick:
        lines += ["", "**A quick run: few repetitions, shortened chains. Not a measurement.**"]
    return lines
