"""The error of the fast mode: its ranks beside those of full fits of the same campaigns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

FACTOR = 1.5
"""Differences this many times those of chance are an error of the fast mode's own."""


@dataclass(frozen=True)
class Agreement:
    """Ranks of two modes on the same campaigns.

    - `campaigns`, `quantities`. - `rms`, `greatest`: of the differences; `where`: quantity of the
      greatest. - `chance`: rms that the finite number of draws alone would make.
    - `shift`: mean difference, fast less full.
    """

    campaigns: int
    quantities: int
    rms: float
    greatest: float
    where: str
    chance: float
    shift: float

    @property
    def ok(self) -> bool:
        """Whether the fast mode can stand in for the full one."""
        return self.rms <= FACTOR * self.chance

    @property
    def says(self) -> str:
        """What was found, in a sentence."""
        return (
            f"ranks of fast and full fits of {self.campaigns} campaigns differ by {self.rms:.3f} "
            f"(rms; {self.chance:.3f} by chance), at most {self.greatest:.2f} ({self.where}), in "
            f"the mean by {self.shift:+.4f}"
        )


def agreement(
    fast: Sequence[Mapping[str, Any]], full: Sequence[Mapping[str, Any]]
) -> Agreement | None:
    """Compare rows of both modes; None where no campaign was fitted both ways.

    - `fast`, `full`: values of rows.
    """
    slow = {value["campaign"]: value for value in full if value["good"]}
    pairs = [
        (value, slow[value["campaign"]])
        for value in fast
        if value["good"] and value["campaign"] in slow
    ]
    found = [
        (
            name,
            rank - other["ranks"][name],
            rank * (1.0 - rank) * (1 / one["ess"] + 1 / other["ess"]),
        )
        for one, other in pairs
        for name, rank in one["ranks"].items()
        if name in other["ranks"]
    ]
    if not found:
        return None
    names, differences, variances = zip(*found, strict=True)
    apart = np.array(differences)
    at = int(np.argmax(abs(apart)))
    return Agreement(
        campaigns=len(pairs),
        quantities=len(set(names)),
        rms=float(np.sqrt(np.mean(apart**2))),
        greatest=float(abs(apart[at])),
        where=names[at],
        chance=float(np.sqrt(np.mean(variances))),
        shift=float(apart.mean()),
    )
