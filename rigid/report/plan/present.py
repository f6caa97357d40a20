"""From the ranking of records to what its section of the page shows."""

from typing import Any

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
from rigid.spec import Spec

LITTLE = 0.95
"""Of the sd: a record that leaves more of it is not worth much."""
TOLD = 3
"""Records that stand on the first screen."""
NOTES = (
    "Around points drawn of the posterior the log-posterior is taken for quadratic. A record that "
    "could be taken is simulated at each point, with noise and rounding, and its information on "
    "what it shares with the others is added to theirs; its own flow fraction, preload and instant "
    "are new and have their priors. The factor is that of the standard deviation: its median over "
    "the points, and in brackets 5 to 95 % of them.",
    "A spec names other records, their costs, and limits under [plan]; records are ranked by the "
    "logarithm of the factor over the cost. The first three were weighed anew at other points, so "
    "that the first does not promise what chance gave it, and each where a fit with it may come to "
    "lie: if the model is right, the brackets of these three hold what would be found in nine "
    "cases of ten.",
)
"""How to read the tables."""


def content(spec: Spec, made: dict[str, Any], provenance: Provenance) -> FoundContent:
    """Gather the section; `made` is what goes to plan.json."""
    return found_content(spec, made, provenance, front(made), NOTES)


def possible(made: dict[str, Any]) -> list[dict[str, Any]]:
    """Records that keep all limits, the worthiest first."""
    return [one for one in made["records"] if one["beyond"] is None]


def told(one: dict[str, Any], quantity: str, records: int = 1) -> dict[str, Any]:
    """What so many such records are expected to tell of a quantity."""
    return next(e for e in one["expected"] if e["quantity"] == quantity and e["records"] == records)


def front(made: dict[str, Any]) -> Front:
    """Question, the record to take, what it is expected to tell."""
    first, listed = made["quantities"][0], possible(made)
    little = not listed or told(listed[0], first["name"])["factor"] > LITTLE
    return Front(
        asked=f"Which record, taken next, would tell most of {first['name']}?",
        state=BAD if not made["usable"] else RESERVE if little else GOOD,
        ruling=ruling(made),
        why=tuple(one["says"] for one in made["checks"] if not one["ok"]),
        answers=tuple(
            Answer(one["record"], _reduced(told(one, first["name"])), _several(one, first["name"]))
            for one in listed[:TOLD]
        ),
        cannot=(_nothing(made),) if little and listed else (),
        next=() if not listed else (f"Take {recorded(listed[0])}.",),
        figure="expected",
    )


def ruling(made: dict[str, Any]) -> str:
    """The record to take, in a sentence."""
    listed, first = possible(made), made["quantities"][0]
    if not made["usable"]:
        return "The fit beneath is not sound: the ranking must not be used as it stands."
    if not listed:
        return "None of the records keeps the limits."
    by = "for its cost " if len({one["cost"] for one in listed}) > 1 else ""
    return (
        f"{_capital(recorded(listed[0]))} tells most {by}of {first['name']}: its standard "
        f"deviation, {_quantity_sd(first)}, is expected to become "
        f"{_reduced(told(listed[0], first['name']))}."
    )


def recorded(one: dict[str, Any]) -> str:
    """A record that could be taken, in a sentence."""
    return f"a record {one['record']}" if one["record"].startswith("like ") else one["record"]


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]


def _quantity_sd(quantity: dict[str, Any]) -> str:
    return metrology.significant(quantity["sd"], quantity["unit"], 2)


def _reduced(expected: dict[str, Any]) -> str:
    """The factor of the sd, with its spread over the posterior."""
    low, high = expected["factor_q05"], expected["factor_q95"]
    return f"{expected['factor']:.2f} times as large ({low:.2f} to {high:.2f})"


def _several(one: dict[str, Any], quantity: str) -> str:
    """What more such records are expected to do."""
    more = [e for e in one["expected"] if e["quantity"] == quantity and e["records"] > 1]
    return ", ".join(f"{e['records']} of them: {e['factor']:.2f}" for e in more)


def _nothing(made: dict[str, Any]) -> str:
    return (
        f"Tell much more of {made['quantities'][0]['name']} by one record: each leaves more than "
        f"{LITTLE:.2f} of the standard deviation."
    )


def table(made: dict[str, Any]) -> str:
    """The result as a table for the terminal."""
    names = [one["name"] for one in made["quantities"]]
    wide = max(len(one["record"]) for one in made["records"]) + 2
    lines = [
        f"{ruling(made)}",
        f"{'record':{wide}}{'cost':>7}" + "".join(f"{name:>17}" for name in names),
    ]
    for one in made["records"]:
        factors = "".join(f"{told(one, name)['factor']:17.3f}" for name in names)
        beyond = "" if one["beyond"] is None else f"  {one['beyond']['what']} beyond its limit"
        lines.append(f"{one['record']:{wide}}{one['cost']:7g}{factors}{beyond}")
    return "\n".join(lines) + "\n"
