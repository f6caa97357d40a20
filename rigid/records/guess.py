"""What a column of a file may hold: guessed from its name and the unit that the file states."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from rigid.records.table import Table
from rigid.records.units import BETWEEN, DIMENSIONS, TIMESTAMP, UNITS, dimensioned, hinted, known

WORDS = {
    "time": ("timestamp", "datetime", "time", "elapsed", "zeit", "sekunde", "sekunden", "t", "ms"),
    "load": ("loadcell", "load", "force", "kraft", "last", "f"),
    "stroke": ("stroke", "displacement", "disp", "lvdt", "position", "pos", "travel", "weg", "hub",
               "s", "x"),
    "pressure": ("pressure", "press", "druck", "p"),
    "acceleration": ("acceleration", "accel", "acc", "beschleunigung", "a", "ax", "ay", "az"),
}  # fmt: skip
"""English and German; of a word of one letter the unit decides, where there is one."""
SPELT = ("left", "right", "links", "rechts")
SIDES = re.compile(rf"[A-DLR]|\d|{'|'.join(SPELT)}", re.IGNORECASE)
"""What tells one cylinder's columns from another's, at the end of their names; if spelt, before."""
PARTS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+|[^\W\d_]+")
BRACKETS = re.compile(r"[\[(][^\[\]()]*[\])]")


@dataclass(frozen=True)
class Guess:
    """A column and what it may hold; an empty text where nothing is guessed.

    - `quantity`: of a channel. - `unit`: as the spec names it. - `cylinder`: as the name ends.
    - `why`: what the guess rests on, or why there is none.
    """

    column: str
    quantity: str
    unit: str
    cylinder: str
    why: str


def guesses(table: Table) -> tuple[Guess, ...]:
    """Return what each column of a file may hold, in the order of the file."""
    return tuple(_guess(table, name) for name in table.columns)


def _guess(table: Table, name: str) -> Guess:
    """Return what one column may hold; name and unit must not contradict each other."""
    if name in table.refused:
        return Guess(name, "", "", "", f"holds no numbers: {table.refused[name]}")
    if name in table.timestamps:
        return Guess(name, "time", TIMESTAMP, "", "holds time stamps")
    first, *more = BETWEEN.split(BRACKETS.sub(" ", name).strip())
    bare = " ".join([first, *(word for word in more if not known(word))])
    words = [part.lower() for part in PARTS.findall(bare)]
    if len(words) > 1 and words[0] in SPELT:  # `left load` as `load left`
        words = [*words[1:], words[0]]
    said = next((q for q, names in WORDS.items() if words and words[0] in names), "")
    stated = table.units.get(name, "")
    meant = dimensioned(UNITS[stated][0]) if stated else ""
    if said and meant and said != meant:
        why = f"the name says {said}, the unit {stated} {meant}"
        return Guess(name, "", stated, "", why)
    quantity = said or meant
    if not quantity:
        return Guess(name, "", "", "", "neither the name nor a unit says what it is")
    unit = stated or hinted(name, quantity) or _own(name, quantity)
    side = words[-1] if len(words) > 1 and SIDES.fullmatch(words[-1]) else ""
    cylinder = side.upper() if len(side) == 1 else side
    by = [one for one, there in (("its name", said), ("its unit", meant)) if there]
    return Guess(name, quantity, unit, cylinder, f"guessed from {' and '.join(by)}")


def _own(name: str, quantity: str) -> str:
    """Return the unit that a name consists of, as `ms` of a time; empty where it does not."""
    return name if UNITS.get(name, ("",))[0] == DIMENSIONS[quantity] and len(name) > 1 else ""


def cylinders(found: Iterable[Guess]) -> tuple[str, ...]:
    """Return the ends of names that tell cylinders apart, in the file's order; at least one."""
    sides = dict.fromkeys(g.cylinder for g in found if g.quantity not in ("", "time"))
    return tuple(side for side in sides if side) or ("",)
