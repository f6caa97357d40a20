"""How the names that discovery gave first turned out in campaigns that no development used.

`tests/studies/held_out.py` counts them; a probability is only as good as what it came to there.
"""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

TOLD = Path(__file__).with_name("held_out.json")
BANDS = ((0.0, 0.5), (0.5, 0.8), (0.8, np.inf))
"""Probabilities of a name that are counted together: from, below."""


class Turned(NamedTuple):
    """What came of names as sure as one, in campaigns of one simulator.

    - `simulator`. - `code`: commit. - `listed`: right names, and names given, where the cause has
      an entry in the catalogue. - `unlisted`: campaigns with such a name, and campaigns, where it
      has none. - `nothing`: campaigns with a wrong name, and campaigns, where nothing is missing.
    """

    simulator: str
    code: str
    listed: tuple[int, int]
    unlisted: tuple[int, int]
    nothing: tuple[int, int]


def turned_out(probability: float) -> tuple[str, tuple[Turned, ...]]:
    """Of names whose probability is in the band of one: that band in words, and by simulator."""
    band = next(i for i, (_, high) in enumerate(BANDS) if probability < high)
    low, high = BANDS[band]
    words = f"{low:.1f} to {high:.1f}" if low else f"less than {high:.1f}"
    out = []
    for one in json.loads(TOLD.read_text("utf-8")):
        told = one["bands"][band]
        out.append(
            Turned(
                one["simulator"],
                one["code"],
                (told["listed"]["right"], told["listed"]["named"]),
                (told["unlisted"]["wrong"], told["unlisted"]["campaigns"]),
                (told["nothing"]["wrong"], told["nothing"]["campaigns"]),
            )
        )
    return words if high < np.inf else f"{low:.1f} and more", tuple(out)
