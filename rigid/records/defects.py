"""Defects of a record by name: refused, unless the record's spec accepts them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from rigid.io.errors import InputError
from rigid.spec import DefectName

NAMES: tuple[str, ...] = get_args(DefectName)
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


def causes(defects: Iterable[Defect], accept: Sequence[str]) -> list[Defect]:
    """Return the defects without the `saturated` of channels whose unit is refused."""
    found = list(defects)
    wrong = {d.quantity for d in found if d.name == "unit" and d.name not in accept}
    return [d for d in found if d.name != "saturated" or d.quantity not in wrong]


def settle(where: str, defects: Iterable[Defect], accept: Sequence[str]) -> tuple[str, ...]:
    """Return a note for each accepted defect.

    - where: file and record, what every message begins with
    - accept: names of the defects that the record's spec accepts

    Raises InputError, a line for each, when defects remain.
    """
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
