"""Plain tables: comma, semicolon or tab between the columns, with or without a header."""

import csv
import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from rigid.io.errors import InputError, quoted
from rigid.records.table import Table, build, is_number, is_stamp, missing
from rigid.records.units import known

SEPARATORS = (";", "\t", ",")
COMMENT = "#"
TITLES = "lines above the header were passed over: {}"
LOOK_AT = 20  # lines from which the separator is told
SEP_LINE = re.compile(r'"?sep=([;,\t|])"?\s*', re.IGNORECASE)  # a spreadsheet's first line
QUOTED = re.compile(r'"[^"]*"')


def parse(path: Path, text: str) -> Table:
    """Return the table of a plain text file.

    A header is told by cells that are no numbers, a row of units by standing below it with no
    number in it. Without a header the columns are named 1, 2, ..., or by a line that begins with #
    and stands above the rows. Other lines that begin with # and empty lines are passed over.
    Numbers may have a decimal comma where the separator is none. A first line `sep=;` is obeyed;
    titles above the header are passed over, with a note.

    Raises InputError when there are no two columns, no rows, or rows of unequal length.
    """
    lines = text.split("\n")
    given = SEP_LINE.fullmatch(lines[0])
    if given:
        lines[0] = ""
    separator = given[1] if given else separator_of(path, lines)
    above = titles(lines, separator)
    lines[:above] = [""] * above
    body, numbers = split(path, lines, separator)
    if not body:
        raise InputError(f"{path}: the file has no data rows; record again or name another file")
    comma = separator != ","
    skip = 0
    if is_header(body[0], comma):
        skip = 2 if len(body) > 1 and is_header(body[1], comma, every=True) else 1
    names: Sequence[str] = [str(k + 1) for k in range(len(body[0]))]
    heads = body[:skip]
    if skip == 0 or (skip == 1 and is_units(body[0])):
        heads = commented(lines[: numbers[0] - 1], separator, len(body[0])) + heads
    units: Sequence[str] = ()
    if skip == 2 or (len(heads) > 1 and is_units(heads[-1])):
        names, units = heads[-2:]
    elif heads:
        names = heads[-1]
    table = build(path, names, body[skip:], numbers[skip:], comma, units=units)
    if not above:
        return table
    return replace(table, notes=(TITLES.format(above), *table.notes))


def titles(lines: Sequence[str], separator: str) -> int:
    """How many lines stand above a header: with fewer cells than it and the rows below it have.

    A spreadsheet fills a title up with empty cells; they do not count.
    """
    seen = [(n, line) for n, line in enumerate(lines) if line.strip() and line[:1] != COMMENT]
    seen = seen[:LOOK_AT]
    width = [line.count(separator) for _, line in seen]
    bare = itertools.takewhile(lambda each: separator not in each[1].rstrip(f"{separator} "), seen)
    for k, _ in enumerate(bare):
        width[k] = 0
    if len(seen) < 3 or width[0] >= width[-1]:
        return 0
    first = width.index(width[-1])
    head = [cell.strip() for cell in seen[first][1].split(separator)]
    below = set(width[first:]) == {width[-1]} and max(width[:first]) < width[-1]
    return seen[first][0] if below and is_header(head, separator != ",", every=True) else 0


def commented(lines: Iterable[str], separator: str, width: int) -> list[tuple[str, ...]]:
    """Return those lines that begin with # and name `width` columns, cells without the #."""
    found = []
    for line in lines:
        if line.startswith(COMMENT):
            bare = [line.removeprefix(COMMENT)]
            row = next(csv.reader(bare, delimiter=separator, skipinitialspace=True), [])
            if len(row) == width > 1 and is_header(row, False, every=True):
                found.append(tuple(row))
    return found


def is_units(cells: Sequence[str]) -> bool:
    """Whether every cell is a known unit or empty."""
    return any(map(known, cells)) and all(known(c) or missing(c) for c in cells)


def split(
    path: Path, lines: Iterable[str], separator: str, first: int = 1, comment: str = COMMENT
) -> tuple[list[tuple[str, ...]], list[int]]:
    """Return the rows as cells, and the line each stands in.

    - first: number of the first of `lines` in the file
    - comment: lines that begin with it are passed over, as are empty ones

    Raises InputError when quotation marks do not match.
    """
    blanked = ["" if line[:1] == comment else line for line in lines]
    reader = csv.reader(blanked, delimiter=separator, skipinitialspace=True, strict=True)
    body, numbers = [], []
    try:
        for cells in reader:
            if len(cells) > 1 or (cells and cells[0].strip()):
                body.append(tuple(cells))  # of text alone: no work for the garbage collector
                numbers.append(reader.line_num + first - 1)
    except csv.Error as error:
        raise InputError(
            f"{path}: line {reader.line_num + first - 1} cannot be split into cells ({error}); "
            "repair its quotation marks"
        ) from error
    return body, numbers


def separator_of(path: Path, lines: list[str]) -> str:
    """Return what separates the columns; raises InputError when there is only one column."""
    full = (QUOTED.sub("", line) for line in lines if line.strip() and not line.startswith(COMMENT))
    sample = [line for line, _ in zip(full, range(LOOK_AT), strict=False)]
    if not sample:
        raise InputError(f"{path}: the file has no data rows; record again or name another file")
    for separator in SEPARATORS:
        shares = sum(separator in line for line in sample)
        told = separator in sample[0] or titles(lines, separator)
        if told and 2 * shares > len(sample):
            return separator
    raise InputError(
        f"{path}: no columns found in line 1, {quoted(lines[0])}; "
        "put a comma, a semicolon or a tab between the columns"
    )


def is_header(cells: Sequence[str], comma: bool, every: bool = False) -> bool:
    """Whether a row holds names or units: cells that are neither numbers nor time stamps.

    - every: no cell may be a number or a time stamp, as in a row of units
    """
    data = [is_number(c, comma) or is_stamp(c) for c in cells if not missing(c)]
    return bool(data) and (not any(data) if every else not all(data))
