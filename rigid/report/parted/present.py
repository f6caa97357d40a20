"""From the ranking of records by how far they part two effects to what the page shows."""

from collections.abc import Iterator
from typing import Any

from rigid.planning.parting import often
from rigid.plots import metrology
from rigid.report.content import (
    BAD,
    GOOD,
    RESERVE,
    Answer,
    FoundContent,
    Front,
    Provenance,
    found_content,
)
from rigid.report.plan.present import possible, recorded
from rigid.spec import Spec

ENOUGH = 0.95
"""Share of campaigns in which two effects are told apart, from which on a record is enough."""
FOLLOWING = 3
"""Records that stand on the first screen."""
NOTES = (
    "Around the fit without either effect, both leave a change in every record in proportion to "
    "their amplitude. What matters is the part of it that the fit cannot absorb. The two are as "
    "far apart as half the distance of these parts, in noise, the first effect being as large as "
    "the present records say. An ideal observer then tells them apart in the share of campaigns "
    "that is given.",
    "A record that could be taken is simulated at the fit; its own flow fraction, preload and "
    "instant are new and have their priors. Records are ranked by the log odds that one of them "
    "adds, over its cost. Which effect it is in truth, and whether it is one of the two at all, is "
    "not asked here.",
)
"""How to read the table."""


def content(spec: Spec, made: dict[str, Any], provenance: Provenance) -> FoundContent:
    """Gather the section; `made` is what goes to plan-between.json."""
    return found_content(spec, made, provenance, front(made), NOTES)


def front(made: dict[str, Any]) -> Front:
    """Question, the record to take, how often it tells."""
    listed, pair = possible(made), made["between"]
    enough = bool(listed) and _one(listed[0]) >= ENOUGH
    state = BAD if not made["usable"] else GOOD if enough else RESERVE
    return Front(
        asked=f"Which record would tell {pair['first']} from {pair['other']}?",
        state=state,
        ruling=ruling(made),
        why=tuple(one["says"] for one in made["checks"] if not one["ok"]),
        answers=tuple(
            Answer(one["record"], often(one["expected"][0]["told"]), _several(one))
            for one in listed[:FOLLOWING]
        ),
        cannot=tuple(_cannot(made, enough)),
        next=() if not listed else (f"Take {recorded(listed[0])}.",),
        figure="apart",
    )


def ruling(made: dict[str, Any]) -> str:
    """The record to take, in a sentence."""
    listed, pair = possible(made), made["between"]
    if not made["usable"]:
        return "The fit beneath is not sound: the ranking must not be used as it stands."
    if not listed:
        return "None of the records keeps the limits."
    by = "for its cost " if len({one["cost"] for one in listed}) > 1 else ""
    said = recorded(listed[0])
    return (
        f"{said[0].upper()}{said[1:]} tells {pair['first']} from {pair['other']} best {by}: with "
        f"it in {often(_one(listed[0]))}, now in {often(made['now']['told'])}."
    ).replace(" :", ":")


def _one(record: dict[str, Any]) -> float:
    return record["expected"][0]["told"]


def _several(one: dict[str, Any]) -> str:
    more = one["expected"][1:]
    return ", ".join(f"{e['records']} of them: {100 * e['told']:.0f} %" for e in more)


def _cannot(made: dict[str, Any], enough: bool) -> Iterator[str]:
    """What these records, or one more, do not tell."""
    pair = made["between"]
    if _absent(pair):
        yield f"That either is there at all: nothing speaks for {pair['first']} ({_odds(pair)})."
    if not enough:
        yield (
            f"Tell {pair['first']} from {pair['other']} in 19 of 20 campaigns by one more record, "
            "were either as large as these records say."
        )


def _absent(pair: dict[str, Any]) -> bool:
    """Whether the records speak for neither effect."""
    return max(pair["log_bayes"].values()) <= 0.0


def _odds(pair: dict[str, Any]) -> str:
    logs = pair["log_bayes"]
    return "log Bayes factors " + ", ".join(f"{name} {log:+.1f}" for name, log in logs.items())


def table(made: dict[str, Any]) -> str:
    """The result as a table for the terminal."""
    pair, rows = made["between"], made["records"]
    amplitude = pair["amplitude"]
    size = metrology.significant(amplitude["value"], amplitude["unit"], 2)
    wide = max((len(one["record"]) for one in rows), default=0) + 2
    counts = [e["records"] for e in rows[0]["expected"]] if rows else []
    lines = [
        ruling(made),
        f"{pair['first']} has {amplitude['name']} = {size} by these records; {_odds(pair)}",
        f"{'record':{wide}}{'cost':>7}" + "".join(f"{f'{n} told [%]':>13}" for n in counts),
    ]
    for one in rows:
        told = "".join(f"{100 * e['told']:13.1f}" for e in one["expected"])
        beyond = "" if one["beyond"] is None else f"  {one['beyond']['what']} beyond its limit"
        lines.append(f"{one['record']:{wide}}{one['cost']:7g}{told}{beyond}")
    return "\n".join(lines) + "\n"
