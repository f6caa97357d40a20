"""How the names that discovery gave first turned out in campaigns that no development used.

`tests/studies/held_out.py` counts them; a probability is only as good as what it came to there.
"""

import functools
import json
from pathlib import Path
from typing import NamedTuple

TOLD = Path(__file__).with_name("held_out.json")
BANDS = ((0.0, 0.5), (0.5, 0.8), (0.8, 1.01))
"""Probabilities of a name that are counted together: from, below."""


class Turned(NamedTuple):
    """What came of names as sure as one, in campaigns of one simulator.

    - `simulator`; `code`: commit. - `listed`: right names, and names given, where the
      cause has an entry in the catalogue. - `unlisted`: campaigns with such a name, and campaigns,
      where it has none. - `nothing`: the same where nothing is missing.
    """

    simulator: str
    code: str
    listed: tuple[int, int]
    unlisted: tuple[int, int]
    nothing: tuple[int, int]


@functools.cache
def turned_out(probability: float) -> tuple[Turned, ...]:
    """Of names whose probability is in the band of one, by simulator."""
    band = next(i for i, (low, high) in enumerate(BANDS) if low <= probability < high)
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
    return tuple(out)


def band_of(probability: float) -> str:
    """The band of a probability in words."""
    low, high = next(band for band in BANDS if band[0] <= probability < band[1])
    if high > 1.0:
        return f"{low:.1f} and more"
    return f"{low:.1f} to {high:.1f}" if low else f"less than {high:.1f}"
