"""What would be right to say of a campaign of the second simulator, and where its cause acts."""

from collections.abc import Mapping
from typing import Any

from discovery_scores import NOTHING, UNNAMED, Known

Row = Mapping[str, Any]
COMPLETE, CATALOGUED, OUTSIDE = "nothing missing", "in the catalogue", "outside the catalogue"
STRAPS = ("slow-strap", "linear-strap", "exponential-strap")
TWIN = 0.98
"""Cosine of the traces of two causes from which on either name is right."""
EQUATIONS = dict.fromkeys(("square-friction", "tight-place"), "plunger-momentum")
"""Where causes enter that the catalogue has not; all others enter where their nearest does."""
DRIVEN = ("frame", "free-run")
KINDS = {
    **dict.fromkeys(("intake-density", "hose", "stage", "ripple", "valve-ramp"), DRIVEN),
    **dict.fromkeys(("stroke-lag", "lagging-gauge", "clock", "drift"), DRIVEN),
    **dict.fromkeys(("creeping-cell", "warming", "tight-place"), DRIVEN),
    **dict.fromkeys((*STRAPS, "mounting-resonance"), ("release",)),
    **dict.fromkeys(("slack", "hysteretic-cell"), ("frame",)),
}
"""Kinds of records in which a cause shows, where that is not all: what is pumped, what is read."""
ACTS = dict.fromkeys(("release-on-a-sample", "release-on-a-sample-coloured"), "sample-averaging")
"""What acts in populations in which nothing is hidden: their converters average over a tenth of an
interval. Who says so is right, and so is who says that nothing is missing."""


def sort_of(row: Row) -> str:
    """Whether nothing is missing, or a cause of the catalogue or from outside it is hidden."""
    if row["nearest"]:
        return CATALOGUED
    return OUTSIDE if row["hidden"] else COMPLETE


def alike(known: Known, name: str) -> set[str]:
    """A name and those of all causes that leave the same trace."""
    if name not in known.names:
        return {name}
    return {name} | {other for other in known.names if known.cosine(name, other) >= TWIN}


def right_names(known: Known, row: Row) -> set[str]:
    """What would be right to say first."""
    sort, acts = sort_of(row), ACTS.get(row["case"]["population"])
    if sort == COMPLETE:
        return {NOTHING} | (alike(known, acts) if acts else set())
    return {UNNAMED} if sort == OUTSIDE else alike(known, row["nearest"])


def acting(truth: Row) -> list[dict[str, Any]]:
    """Equation and records of what is hidden, from truth.json, as the benchmark has them."""
    from rigid.generator.hidden import HIDDEN

    population, nearest = truth["population"], truth["nearest"]
    equation = HIDDEN[nearest].equation if nearest else EQUATIONS.get(population)
    if equation is None:
        return []
    kinds = KINDS.get(population)
    records = {run["name"] for run in truth["runs"] if kinds is None or run["kind"] in kinds}
    return [{"equation": equation, "records": sorted(records)}]
