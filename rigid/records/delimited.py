"""Plain tables: comma, semicolon or tab between the columns, with or without a header."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from rigid.errors import InputError
from rigid.records.table import Table, build, is_number, is_stamp, missing

SEPARATORS = (";", "\t", ",")
COMMENT = "#"
LOOK_AT = 20  # lines from which the separator is told


def parse(path: Path, text: str) -> Table:
    """Return the table of a plain text file.

    A header is told by cells that are no numbers, a row of units by standing below it with no
    number in it. Without a header the columns are named 1, 2, ... Lines that begin with # and
    empty lines are passed over. Numbers may have a decimal comma where the separator is none.

    Raises InputError when there are no two columns, no rows, or rows of unequal length.
    """
    lines = text.split("\n")
    separator = separator_of(path, lines)
    body, numbers = split(path, lines, separator)
    comma = separator != ","
    names: Sequence[str] = [str(k + 1) for k in range(len(body[0]))]
    skip = 0
    if is_header(body[0], comma):
        names = body[0]
        skip = 2 if len(body) > 1 and is_header(body[1], comma, every=True) else 1
    return build(path, names, body[skip:], numbers[skip:], comma)


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
    full = (line for line in lines if line.strip() and not line.startswith(COMMENT))
    sample = [line for line, _ in zip(full, range(LOOK_AT), strict=False)]
    if not sample:
        raise InputError(f"{path}: the file has no data rows; record again or name another file")
    for separator in SEPARATORS:
        if 2 * sum(separator in line for line in sample) > len(sample):
            return separator
    raise InputError(
        f"{path}: no columns found in line 1, {lines[0][:60]!r}; "
        "put a comma, a semicolon or a tab between the columns"
    )


def is_header(cells: Sequence[str], comma: bool, every: bool = False) -> bool:
    """Whether a row holds names or units: cells that are neither numbers nor time stamps.

    - every: no cell may be a number or a time stamp, as in a row of units
    """
    data = [is_number(c, comma) or is_stamp(c) for c in cells if not missing(c)]
    return bool(data) and (not any(data) if every else not all(data))
