"""Where model and records disagree, before and after what was added, for programs and the page."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rigid.discovery.disagreement import (
    ALL,
    FREQUENCY,
    LAG,
    SPEED,
    TIME,
    Disagreement,
    disagreements,
)
from rigid.discovery.outcome import Outcome
from rigid.physics import sensors
from rigid.plots import metrology
from rigid.report.discovery.section import ComparedShown

SURE, TOLD = 0.05, 10
"""P-value below which a disagreement is one, and how many are told."""
FIRST = (TIME, FREQUENCY, LAG, SPEED)
UNITS = sensors.UNITS | {TIME: "s", FREQUENCY: "Hz", LAG: "s", SPEED: "m/s", "position": "m"}


class Compared(NamedTuple):
    """All that was looked at, without and with what was added; `after` is None where nothing was.

    - `records`: name and cylinder of a record, by its label.

    The surest disagreement of the model as specified comes first.
    """

    before: tuple[Disagreement, ...]
    after: dict[tuple[str, str, str], Disagreement] | None
    records: Mapping[str, tuple[str, str]]


def compared(outcome: Outcome, seed: int) -> Compared:
    """Compare records and predictions around the first fit and around the last."""
    traces = outcome.bench.traces
    before = disagreements(outcome.base, traces, seed)
    records = {t.label: (t.name, t.cylinder) for t in outcome.base.layout.problem.tracks}
    if outcome.final is outcome.base:
        return Compared(before, None, records)
    after = disagreements(outcome.final, traces, seed)
    return Compared(before, {_key(one): one for one in after}, records)


def _key(one: Disagreement) -> tuple[str, str, str]:
    return (one.record, one.quantity, one.over)


def unit_of(over: str) -> str:
    """Unit of what a disagreement goes by."""
    return UNITS.get(over, "1")


def told(found: Compared) -> list[dict[str, Any]]:
    """The surest disagreements, for discovery.json: those that are ones, the first in any case."""
    kept = [one for one in found.before if one.p_value < SURE] or list(found.before[:1])
    return [_told(one, found) for one in kept[:TOLD]]


def _told(one: Disagreement, found: Compared) -> dict[str, Any]:
    record, cylinder = found.records.get(one.record, (None, None))
    later = None if found.after is None else found.after.get(_key(one))
    return {
        "record": record,
        "cylinder": cylinder,
        "channel": one.quantity,
        "over": one.over,
        "from": one.where[0],
        "to": one.where[1],
        "unit": unit_of(one.over),
        "p_value": one.p_value,
        "p_value_alone": one.alone,
        "p_value_after": None if later is None else later.p_value,
    }


def sentence(found: Compared) -> str:
    """Whether and how often model and records disagree beyond chance."""
    if not found.before:
        return "No channel has enough samples to be compared with what is expected of it."
    least = min(one.p_value for one in found.before)
    sure = sum(one.p_value < SURE for one in found.before)
    looked = f"{len(found.before)} comparisons of residuals, once the parameters were fitted"
    if not sure:
        return (
            f"Model and records disagree nowhere beyond chance, in {looked}: the least p-value "
            f"that counts them all is {least:.2g}. What is spread over many channels may still "
            "show in all together."
        )
    return (
        f"Model and records disagree in {sure} of {looked}: by more than chance leaves anywhere in "
        "19 of 20 campaigns of a complete model. The p-values count all that was looked at."
    )


def table(listed: list[dict[str, Any]]) -> tuple[tuple[str, str, str, str, str], ...]:
    """Rows for the page of what `told` gave; see `DiscoveryContent.where`."""
    return tuple(_row(one) for one in listed if one["p_value"] < SURE)


def channel_of(one: dict[str, Any]) -> str:
    """Name of the channel that a disagreement of discovery.json is of."""
    record = ALL if one["record"] is None else f"{one['record']},{one['cylinder']}"
    return f"{record} {one['channel']}"


def place_of(one: dict[str, Any]) -> str:
    """Where a disagreement of discovery.json is most."""
    low, high = (metrology.significant(one[end], one["unit"]) for end in ("from", "to"))
    return low if low == high else f"{low} to {high}"


def _row(one: dict[str, Any]) -> tuple[str, str, str, str, str]:
    after = one["p_value_after"]
    return (
        channel_of(one),
        one["over"],
        place_of(one),
        metrology.chance(one["p_value"]),
        "" if after is None else metrology.chance(after),
    )


def shown(found: Compared) -> ComparedShown:
    """The same for a picture: p-values of all channels over all that was looked at."""
    rows = tuple(sorted({(one.record, one.quantity) for one in found.before}))
    seen = dict.fromkeys(one.over for one in found.before)
    columns = (*(c for c in FIRST if c in seen), *sorted(c for c in seen if c not in FIRST))

    def table(values: dict[tuple[str, str, str], Disagreement]) -> np.ndarray:
        missing = np.full((len(rows), len(columns)), np.nan)
        for (record, quantity, over), one in values.items():
            missing[rows.index((record, quantity)), columns.index(over)] = one.p_value
        return missing

    before = table({_key(one): one for one in found.before})
    names = tuple(f"{record} {quantity}" for record, quantity in rows)
    return ComparedShown(
        names, columns, before, None if found.after is None else table(found.after)
    )
