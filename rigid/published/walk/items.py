"""One thing that the paper prints beside what is computed here, and the verdict on the two."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rigid.published.walk.errata import ERRATA, Erratum

GIVEN = "given"
COMPUTED = "computed"
REPRODUCED = "reproduced"
DIFFERS = "differs"
MISPRINT = "misprint"
ENTRIES = (
    "name", "place", "what", "unit", "printed", "as_printed", "computed", "band",
    "relative_difference", "verdict", "explained", "reason",
)  # fmt: skip
"""Entries of an item in result.json, its erratum beside."""

_NOTHING_TO_EXPLAIN = (GIVEN, COMPUTED, REPRODUCED)

EXACT = 1e-9
"""Relative difference up to which two ways to compute the same number are the same."""


@dataclass(frozen=True)
class Explanation:
    """Why a printed number and the computed one differ; it holds for these two alone.

    - `erratum`: its key in `ERRATA`; empty where nothing is misprinted.
    - `says`: the reason, a sentence. - `printed`: what it is about, SI.
    - `finds`: what the computation must give for the reason to hold, SI; `within`: by how much.
    """

    erratum: str
    says: str
    printed: float
    finds: float
    within: float

    def holds(self, printed: float, computed: float) -> bool:
        """Whether it is about these two numbers."""
        same = math.isclose(printed, self.printed, rel_tol=EXACT, abs_tol=0.0)
        return same and bool(abs(computed - self.finds) <= self.within)


@dataclass(frozen=True)
class Item:
    """A printed number or equation, and what is computed of it.

    - `name`: unique. - `place`: in the paper. - `what`: in words. - `unit`: of the numbers, SI.
    - `printed`: None for what is drawn only. - `computed`: None for what is taken as given.
    - `band`: 5 and 95 % of the computed under the uncertainty of what it rests on, or None.
    - `half_width`: what is rounded to the print; a computed number within it is reproduced.
    - `bound`: "" | "above" | "below": the print is a bound and no value.
    - `explanation`: of a difference, or None. - `note`: what else there is to say.
    - `as_printed`: digits and unit of the paper; empty for what is no printed number.
    """

    name: str
    place: str
    what: str
    unit: str
    printed: float | None
    computed: float | None = None
    band: tuple[float, float] | None = None
    half_width: float = 0.0
    bound: str = ""
    explanation: Explanation | None = None
    note: str = ""
    as_printed: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the computed number is the printed one, as far as it is printed."""
        if self.printed is None or self.computed is None:
            return False
        if self.bound == "above":
            return bool(self.computed > self.printed)
        if self.bound == "below":
            return bool(self.computed < self.printed)
        slack = EXACT * max(abs(self.printed), abs(self.computed))
        return bool(abs(self.computed - self.printed) <= self.half_width + slack)

    @property
    def explained(self) -> bool:
        """Whether the item needs no further look."""
        if self.verdict in _NOTHING_TO_EXPLAIN:
            return True
        why = self.explanation
        return why is not None and why.holds(self.printed or 0.0, self.computed or 0.0)

    @property
    def verdict(self) -> str:
        """One of `VERDICTS`.

        "given" is what is taken as printed; "computed" is what the paper draws or says in words.
        """
        if self.printed is None:
            return COMPUTED
        if self.computed is None:
            return GIVEN
        if self.agrees:
            return REPRODUCED
        why = self.explanation
        if why is None or not why.holds(self.printed, self.computed):
            return DIFFERS
        return MISPRINT if why.erratum and ERRATA[why.erratum].misprint else DIFFERS

    @property
    def erratum(self) -> Erratum | None:
        """The erratum that explains a difference."""
        why = self.explanation
        if self.verdict in _NOTHING_TO_EXPLAIN or not self.explained or why is None:
            return None
        return ERRATA.get(why.erratum)

    @property
    def relative_difference(self) -> float | None:
        """(computed - printed)/printed; None where it means nothing."""
        if not self.printed or self.computed is None or self.bound:
            return None
        return (self.computed - self.printed) / abs(self.printed)

    @property
    def reason(self) -> str:
        """Why the numbers differ, or what there is to know of the item."""
        if self.verdict in _NOTHING_TO_EXPLAIN:
            return self.note
        if self.explained and self.explanation is not None:
            return self.explanation.says
        return "The two numbers differ, and no reason for it is known here."

    def values(self) -> Mapping[str, Any]:
        """The item as an entry of result.json."""
        found = self.erratum
        entries = {name: getattr(self, name) for name in ENTRIES}
        return entries | {"erratum": None if found is None else found.heading}
