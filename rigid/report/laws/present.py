"""From the comparison of laws to what its section of the page shows."""

from collections.abc import Mapping
from statistics import NormalDist
from typing import Any

import numpy as np

from rigid.discovery.weighing.verdict import PARTED
from rigid.friction.comparison import CANNOT_TELL, DECIDED, MOST_APART, TIED
from rigid.localfit.scatter import CAMPAIGNS
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

LEAST_TOLD = 0.01
"""Probability from which on a model stands on the first screen."""

TO_DO = (
    "No friction model mends what is wrong: run `rigid discover` on this spec, which looks for "
    "other effects and says where model and records disagree."
)


def content(spec: Spec, made: dict[str, Any], provenance: Provenance) -> FoundContent:
    """Gather the section; `made` is what goes to laws.json."""
    return found_content(spec, made, provenance, front(made), notes(made))


def _where(made: dict[str, Any]) -> str:
    return f" at the joint {made['joint']}" if made["joint"] else ""


def front(made: dict[str, Any]) -> Front:
    """Question, verdict, answers, what these records cannot say, what to do."""
    settled = made["usable"] and made["verdict"] != CANNOT_TELL
    laws = made["laws"]
    record = made["next_record"]
    return Front(
        asked=f"Which of {len(laws)} friction models do the records speak for{_where(made)}?",
        state=GOOD if settled else BAD if not made["usable"] else RESERVE,
        ruling=ruling(made),
        why=tuple(c["says"] for c in made["checks"] if not c["ok"]),
        answers=tuple(
            Answer(
                one["words"],
                f"probability {metrology.chance(one['probability'])}",
                "tied with the first on left-out records" if one["tied"] else "",
            )
            for one in laws
            if one["probability"] > LEAST_TOLD or one["tied"]
        ),
        cannot=()
        if made["verdict"] != CANNOT_TELL
        else (f"Whether friction is {laws[0]['words']} or {_names(made).replace(', ', ' or ')}.",),
        next=(
            *(() if made["usable"] else (TO_DO,)),
            *(() if record is None else (_take(record),)),
        ),
        figure="evidence",
    )


def _take(record: Mapping[str, Any]) -> str:
    """What to record next, and whether it alone would tell the first two models apart."""
    often = 100.0 * NormalDist().cdf(record["apart"])
    told = "more than 99" if often > 99.0 else f"{often:.0f}"
    enough = "" if record["apart"] > PARTED else ", which is less than 19 of 20: take more than one"
    return (
        f"Take {record['record']}: with it, the first model and the likeliest of those tied with "
        f"it are told apart in {told} of 100 campaigns{enough}."
    )


def ruling(made: dict[str, Any]) -> str:
    """The verdict in a sentence."""
    first, names = made["laws"][0], _names(made)
    failed = {one["name"] for one in made["checks"] if not one["ok"]}
    if failed == {"solver"}:
        return "The solver's error matters: the comparison must not be used as it stands."
    if failed and "residuals" not in failed:
        return "The comparison must not be used as it stands: a fit is not settled."
    if not made["usable"]:
        return (
            f"No friction model explains the records: the best, {first['words']}, leaves a gap of "
            f"{made['gap']:.2f} (1 is the floor)."
        )
    if made["verdict"] == CANNOT_TELL:
        return f"These records cannot tell: {first['words']}, or {names}."
    told = f"{first['words']} friction (probability {metrology.chance(first['probability'], 2)})"
    if made["verdict"] == TIED:
        return f"{told}. The records do not need the larger {names}."
    return f"{told}; no other model is tied with it."


def _names(made: dict[str, Any]) -> str:
    return ", ".join(one["words"] for one in made["laws"] if one["tied"])


def notes(made: dict[str, Any]) -> tuple[str, ...]:
    """Sentences on how to read the tables."""
    out = [
        "Evidence is the probability of the records under a model, its numbers integrated over "
        "their priors; every model counts as much before the records. The predictive density is "
        "that of each record by a fit to all others, its own flow or preload integrated over.",
        f"Errors are what a difference scatters by in {CAMPAIGNS} simulated campaigns of either "
        f"model. Tied: predictive density not below the first's by its error nor by "
        f"{MOST_APART:g}. A larger model that is tied is not needed where the odds against it are "
        f"above {np.exp(DECIDED):.0f} whatever is done to the priors of its amplitudes.",
    ]
    if made.get("solver") is not None:
        out.append(f"The first model's fit: {made['solver']['says']}.")
    refitted = sum(r["refitted"] for one in made["laws"] for r in one["records"])
    if refitted:
        out.append(f"{refitted} of the left-out predictions rest on a fit of their own.")
    return tuple(out)


def table(made: dict[str, Any]) -> str:
    """The result as a table for the terminal."""
    lines = [
        f"verdict: {made['verdict']}. {ruling(made)}",
        f"{'law':34}{'ln evidence':>18}{'probability':>13}{'left-out density':>20}",
    ]
    for one in made["laws"]:
        lines.append(
            f"{one['words']:34}{one['log_evidence']:10.1f} +- {one['log_evidence_error']:<5.1f}"
            f"{metrology.chance(one['probability']):>12}{one['elpd_difference']:12.1f} +- "
            f"{one['elpd_error']:<5.1f}"
            f"{'tied' if one['tied'] else ''}".rstrip()
        )
    if made["next_record"] is not None:
        lines.append(f"next: {_take(made['next_record'])}")
    return "\n".join(lines) + "\n"
