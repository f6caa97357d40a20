"""The columns of a file as numbers, before they are given a meaning."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rigid.io.errors import InputError, quoted
from rigid.records.units import in_name, known

STAMP = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d+)?)?")
MISSING = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"})


@dataclass(frozen=True, eq=False)
class Table:
    """What a file holds.

    - columns: name -> (n,) float64, in the order of the file; NaN where a cell is empty. A
      column of time stamps holds seconds since its first row
    - rows: (n,) line of the file each sample stands in, counted from 1
    - notes: what was dropped on reading
    - refused: name -> why this column holds no numbers
    - timestamps: names of the columns that hold time stamps
    - units: name -> unit the file states for this column, where it is a known one
    """

    columns: dict[str, np.ndarray]
    rows: np.ndarray
    notes: tuple[str, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    timestamps: frozenset[str] = frozenset()
    units: Mapping[str, str] = field(default_factory=dict)


class NotNumbersError(ValueError):
    """Position and text of a cell that is no number."""

    def __init__(self, position: int, text: str):
        super().__init__(f"{text!r} at {position}")
        self.position, self.text = position, text


def build(
    path: Path,
    names: Sequence[str],
    body: list[tuple[str, ...]],
    lines: list[int],
    comma: bool = False,
    units: Sequence[str] = (),
) -> Table:
    """Return the table of the rows `body`, cells still text.

    - names: of the columns; an empty or repeated name gets its number added
    - lines: of the file, for each row
    - comma: a cell may have a decimal comma
    - units: the file's row of units; a unit in a column's name counts as well

    Raises InputError when rows differ in length or there are none.
    """
    names = unique(without_empty_end(names, body))
    body, lines, dropped = even(path, len(names), body, lines)
    if not body:
        raise InputError(f"{path}: the file has no data rows; record again or name another file")
    columns: dict[str, np.ndarray] = {}
    refused: dict[str, str] = {}
    stamps = set()
    for name, cells in zip(names, zip(*body, strict=True), strict=True):
        try:
            if is_stamp(next((c for c in cells if not missing(c)), "")):
                columns[name] = seconds(cells)
                stamps.add(name)
            else:
                columns[name] = numbers(cells, comma)
        except NotNumbersError as error:
            columns[name] = np.full(len(body), np.nan)
            refused[name] = f"line {lines[error.position]} holds {quoted(error.text)}"
    stated = stated_units(names, units)
    return Table(columns, np.array(lines), tuple(dropped), refused, frozenset(stamps), stated)


def without_empty_end(names: Sequence[str], body: list[tuple[str, ...]]) -> list[str]:
    """Return the names without those empty ones at the end that no row has a cell for."""
    widest = max(map(len, body), default=0)
    end = len(names)
    while end > max(widest, 1) and not names[end - 1].strip():
        end -= 1
    return list(names[:end])


def stated_units(names: Sequence[str], units: Sequence[str]) -> dict[str, str]:
    """Return the known unit of each name, from the row of units or else from the name itself."""
    row = [*units, *[""] * len(names)]
    found = {name: known(unit) or in_name(name) for name, unit in zip(names, row, strict=False)}
    return {name: unit for name, unit in found.items() if unit}


def unique(names: Sequence[str]) -> list[str]:
    """Return the names without surrounding blanks; empty and repeated ones get their number."""
    bare = [name.strip() for name in names]
    count = Counter(bare)
    return [
        name if name and count[name] == 1 else f"{name} (column {k})".strip()
        for k, name in enumerate(bare, start=1)
    ]


def even(
    path: Path, width: int, body: list[tuple[str, ...]], lines: list[int]
) -> tuple[list[tuple[str, ...]], list[int], tuple[str, ...]]:
    """Return the rows with `width` cells each, their lines, and notes.

    Empty cells behind the last column are cut off; a last row that breaks off is dropped.

    Raises InputError when any other row has more or fewer cells.
    """
    for k, cells in enumerate(body):
        if len(cells) == width:
            continue
        if len(cells) > width and not any(c.strip() for c in cells[width:]):
            body[k] = cells[:width]
        elif len(cells) < width and k == len(body) - 1 and k > 0:
            note = f"line {lines[k]}, the last, breaks off and was dropped"
            return body[:-1], lines[:-1], (note,)
        else:
            raise InputError(
                f"{path}: line {lines[k]} has {len(cells)} cells where the file has {width} "
                "columns; repair or remove the line (decimal commas need semicolons or tabs "
                "between the columns)"
            )
    return body, lines, ()


def missing(cell: str) -> bool:
    """Whether the cell says that nothing was recorded."""
    return cell.strip().lower() in MISSING


def is_stamp(cell: str) -> bool:
    """Whether the cell is a time stamp such as 2021-06-18 21:00:00.05."""
    return bool(STAMP.fullmatch(cell.strip().removesuffix("Z")))


def is_number(cell: str, comma: bool = False) -> bool:
    """Whether the cell is a number; `comma` allows a decimal comma."""
    try:
        number(cell, comma)
    except ValueError:
        return False
    return True


def point(cell: str) -> str:
    """Return the cell with its decimal comma, if it has one, made a point."""
    return cell if "." in cell else cell.replace(",", ".", 1)


def number(cell: str, comma: bool) -> float:
    """Return the cell as a number; raises ValueError where it is none, such as Python's 1_000."""
    if "_" in cell:
        raise ValueError(cell)
    return float(point(cell) if comma else cell)


def numbers(cells: Sequence[str], comma: bool) -> np.ndarray:
    """Return the cells as (n,) float64, NaN where nothing was recorded.

    Raises NotNumbersError at the first cell that is neither.
    """
    try:
        if "_" not in "".join(cells):
            return np.array([float(c) for c in cells])
    except ValueError:
        pass
    values = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if missing(cell):
            continue
        try:
            values[k] = number(cell, comma)
        except ValueError:
            raise NotNumbersError(k, cell) from None
    return values


def seconds(cells: Sequence[str]) -> np.ndarray:
    """Return time stamps as (n,) seconds since the first, exact to the microsecond.

    Raises NotNumbersError at the first cell that is neither a time stamp nor empty.
    """
    bare = [c.strip().removesuffix("Z") for c in cells]
    match = STAMP.fullmatch
    for k, cell in enumerate(bare):
        if not match(cell):
            if not missing(cell):
                raise NotNumbersError(k, cells[k])
            bare[k] = "NaT"
    try:
        stamps = np.array(bare, dtype="datetime64[us]")
    except ValueError:
        raise _first_impossible(cells, bare) from None
    known = ~np.isnat(stamps)
    ticks = (stamps - stamps[known][0]).astype(np.int64)
    return np.where(known, ticks / 1e6, np.nan)


def _first_impossible(cells: Sequence[str], bare: list[str]) -> NotNumbersError:
    """The failure to report when a stamp has the right form but names no moment."""
    for k, cell in enumerate(bare):
        try:
            np.datetime64(cell)
        except ValueError:
            return NotNumbersError(k, cells[k])
    return NotNumbersError(0, cells[0])
