"""Campbell Scientific's TOA5: four header lines, then quoted time stamps and numbers."""

import csv
from dataclasses import replace
from pathlib import Path

from rigid.io.errors import InputError, quoted
from rigid.records.delimited import split
from rigid.records.table import Table, build

HEADER_LINES = 4
ENVIRONMENT_FIELDS = 8  # format, station, model, serial, system, program, signature, table
HEADER = ("station", "names", "units", "processing")


def parse(path: Path, text: str) -> Table:
    """Return the table of a TOA5 file; time stamps become seconds since the first row.

    Record numbers may restart. A row that repeats an earlier one in every cell, as happens when
    a table is collected twice, is dropped with a note.

    Raises InputError when the header is not that of TOA5 or the rows do not fit it.
    """
    lines = text.split("\n")
    names, units = header(path, lines)
    data, notes = without_repeats(lines[HEADER_LINES:])
    body, numbers = split(path, data, ",", first=HEADER_LINES + 1)
    table = build(path, names, body, numbers, units=units)
    return replace(table, notes=(*notes, *table.notes))


def header(path: Path, lines: list[str]) -> tuple[list[str], list[str]]:
    """Return names and units of the columns; raises InputError when the header is not TOA5's."""
    first = cells_of(path, lines, 0)
    if first[0] != "TOA5":
        raise InputError(
            f"{path}: line 1 begins with {quoted(first[0])} where TOA5 is known; "
            "convert the file to TOA5 with the logger maker's conversion tool"
        )
    if len(first) != ENVIRONMENT_FIELDS:
        raise InputError(
            f"{path}: line 1 has {len(first)} fields where TOA5 has {ENVIRONMENT_FIELDS}; "
            "the header was changed, export the table again"
        )
    names = cells_of(path, lines, 1)
    for k in range(2, HEADER_LINES):
        found = len(cells_of(path, lines, k))
        if found != len(names):
            raise InputError(
                f"{path}: line {k + 1} ({HEADER[k]}) has {found} fields where line 2 names "
                f"{len(names)} columns; the header is damaged, export the table again"
            )
    return names, cells_of(path, lines, 2)


def cells_of(path: Path, lines: list[str], k: int) -> list[str]:
    """Return the cells of header line `k` (from 0); raises InputError where it breaks off."""
    advice = "the file was cut short, copy or export it again"
    if k >= len(lines) or not lines[k].strip():
        raise InputError(
            f"{path}: the header ends before line {k + 1} ({HEADER[k]}) of the {HEADER_LINES} "
            f"lines that TOA5 has; {advice}"
        )
    if lines[k].count('"') % 2:
        raise InputError(f"{path}: line {k + 1} ({HEADER[k]}) breaks off inside quotes; {advice}")
    return next(csv.reader([lines[k]], skipinitialspace=True))


def without_repeats(lines: list[str]) -> tuple[list[str], tuple[str, ...]]:
    """Return the data lines, those that repeat an earlier line emptied, and notes."""
    first = dict(zip(reversed(lines), range(len(lines) - 1, -1, -1), strict=True))
    if len(first) == len(lines):
        return lines, ()
    kept = [line if first[line] == k else "" for k, line in enumerate(lines)]
    again = [k for k, line in enumerate(lines) if line.strip() and not kept[k]]
    if not again:
        return lines, ()
    note = (
        f"{len(again)} rows that repeat an earlier row exactly were dropped, "
        f"the first in line {again[0] + HEADER_LINES + 1}"
    )
    return kept, (note,)
