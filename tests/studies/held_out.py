"""How the names that discovery gives first turned out, which its page tells whoever gets one.

    python tests/studies/held_out.py

counts sealed campaigns by how sure a name was said to be, and writes the file that the package
reads (`rigid/report/discovery/held_out.json`). Campaigns of the two simulators stand apart. Of the
second those count whose runs ended well; rows of the benchmark do not say which did.
"""

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from discovery_scores import NOTHING, UNNAMED, Known, known_from, statement, true_names
from open_world_scores import judged
from open_world_truth import CATALOGUED, COMPLETE, OUTSIDE, alike
from rows import lines_of

from rigid.report.discovery.held_out import BANDS, TOLD

STUDIES = Path(__file__).parents[2] / "docs" / "studies"
SORTS = {"single": CATALOGUED, "outside": OUTSIDE, "taken out": OUTSIDE, "null": COMPLETE}
"""What sort of campaigns the populations of the benchmark are."""


class Said(NamedTuple):
    """A campaign: its sort, the name said first (None: none was), how sure, and whether right."""

    sort: str
    name: str | None
    probability: float
    right: bool


def of_the_generator(rows: Iterable[Mapping[str, Any]], known: Known) -> list[Said]:
    """Campaigns of the benchmark in which at most one cause is hidden."""
    out = []
    for row in rows:
        sort = SORTS.get(row["case"]["population"])
        if sort is None or "p_value" not in row["answer"]:
            continue
        name, sure = _first(row["answer"])
        right = name is not None and not alike(known, name).isdisjoint(true_names(row))
        out.append(Said(sort, name, sure, right))
    return out


def of_the_second(rows: Sequence[Mapping[str, Any]], known: Known) -> list[Said]:
    """Campaigns of the second simulator whose runs ended well."""
    out = []
    for one in judged(rows, known):
        if one.sound:
            name, sure = _first(one.answer)
            out.append(Said(one.sort, name, sure, name in one.right))
    return out


def _first(answer: Mapping[str, Any]) -> tuple[str | None, float]:
    said = statement(answer)
    if said in (NOTHING, UNNAMED):
        return None, 0.0
    return said, answer["steps"][0]["probability"]


def counted(said: Sequence[Said]) -> list[dict[str, Any]]:
    """Counts by band of how sure a name was said to be."""

    def named(sort: str, low: float, high: float) -> list[Said]:
        return [s for s in said if s.sort == sort and s.name and low <= s.probability < high]

    def many(sort: str) -> int:
        return sum(one.sort == sort for one in said)

    out = []
    for low, high in BANDS:
        listed = named(CATALOGUED, low, high)
        out.append({
            "from": low,
            "listed": {"right": sum(one.right for one in listed), "named": len(listed)},
            "unlisted": {"wrong": _wrong(named(OUTSIDE, low, high)), "campaigns": many(OUTSIDE)},
            "nothing": {"wrong": _wrong(named(COMPLETE, low, high)), "campaigns": many(COMPLETE)},
        })  # fmt: skip
    return out


def _wrong(said: Iterable[Said]) -> int:
    return sum(not one.right for one in said)


class Round(NamedTuple):
    """Sealed campaigns: who made them, their rows, and how these are read."""

    simulator: str
    rows: str
    read: Callable[[list[dict], Known], list[Said]]


ROUNDS = (
    Round(
        "the generator of this package",
        "discovery/discovery-standard-1020001.*.jsonl",
        of_the_generator,
    ),
    Round("a second simulator, of the tests", "open_world/discover-1012001-*.jsonl", of_the_second),
)


def told() -> list[dict[str, Any]]:
    """All rounds, as the package has them."""
    known = known_from(json.loads((STUDIES / "discovery/lookalikes.json").read_text("utf-8")))
    out = []
    for one in ROUNDS:
        rows = lines_of(sorted(STUDIES.glob(one.rows)))
        [code] = {row["commit"] for row in rows}
        bands = counted(one.read(rows, known))
        out.append({"simulator": one.simulator, "code": code, "bands": bands})
    return out


if __name__ == "__main__":
    TOLD.write_text(json.dumps(told(), indent=1) + "\n", "utf-8")
    sys.stdout.write(f"{TOLD.name} written\n")
