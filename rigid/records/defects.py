"""Defects of a record by name: refused, unless the record's spec accepts them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rigid.errors import InputError

NAMES = (
    "time-not-increasing",
    "gap",
    "nan",
    "stuck",
    "saturated",
    "unit",
    "too-short",
)
SHOWN = 3  # places named in a message


@dataclass(frozen=True, eq=False)
class Defect:
    """One thing that is wrong with a record.

    - name: one of `NAMES`
    - quantity: the channel it is in, or `time`
    - says: where, what was found, and what to do
    - samples: (n,) bool, True at the samples concerned
    """

    name: str
    quantity: str
    says: str
    samples: np.ndarray


def settle(where: str, defects: Iterable[Defect], accept: Sequence[str]) -> tuple[str, ...]:
    """Return a note for each accepted defect.

    - where: file and record, what every message begins with
    - accept: names of the defects that the record's spec accepts

    Raises InputError, a line for each, when defects remain or an accepted name is unknown.
    """
    unknown = [name for name in accept if name not in NAMES]
    if unknown:
        raise InputError(
            f"{where}: accept names {unknown[0]!r}, which is no defect; known: {', '.join(NAMES)}"
        )
    notes, refused = [], []
    for defect in defects:
        line = f"{where}, {defect.quantity}: {defect.says}"
        if defect.name in accept:
            notes.append(f"accepted ({defect.name}): {defect.quantity}: {defect.says}")
        else:
            refused.append(f'{line}; or add accept = ["{defect.name}"] to the record')
    if refused:
        raise InputError("\n".join(refused))
    return tuple(notes)


def at_lines(rows: np.ndarray, places: np.ndarray) -> str:
    """Return `line 5`, or `lines 5, 7, 9 and 12 more`, for positions in the record."""
    shown = ", ".join(str(rows[k]) for k in places[:SHOWN])
    more = f" and {len(places) - SHOWN} more" if len(places) > SHOWN else ""
    return f"line{'s' if len(places) > 1 else ''} {shown}{more}"


def runs(same: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first and last position of each run of True in `same`, (n,) bool."""
    edges = np.diff(np.concatenate([[0], same.astype(np.int8), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
