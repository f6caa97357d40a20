"""plan.json and plan.csv: records that could be taken, and what each is expected to tell."""

import dataclasses
from typing import Any

from rigid.inference.proposal import UNRELIABLE
from rigid.inference.reference_check import SolverCheck
from rigid.inference.search_cache import Searched
from rigid.inference.summary import Check
from rigid.io.files import csv_text, finite
from rigid.likelihood.set_aside import listed
from rigid.physics.sensors import UNITS
from rigid.planning.change import Change
from rigid.planning.limits import Beyond
from rigid.planning.ranking import REPEATS, Ranked, Ranking
from rigid.report.taken import taken
from rigid.report.usability import optimum
from rigid.spec import Spec

SCHEMA = 1
SETTINGS = ("preload", "flow", "drive", "duration", "interval", "ranges")
"""What of a record may be changed, as in [[plan.records]]."""


def as_dict(
    spec: Spec, known: Searched, solver: SolverCheck | None, found: Ranking, seed: int
) -> dict[str, Any]:
    """What goes to plan.json; SI, factors are of the standard deviation.

    - `solver`: the check at points of the posterior; None where nothing is solved.
    """
    problem = known.found.problem
    checks = [optimum(known.found.settled), _law(known)]
    checks += [] if solver is None else [solver.check]
    quantities = [
        {"name": name, "unit": unit, "median": finite(m), "sd": finite(s)}
        for name, unit, m, s in zip(
            found.quantities, found.units, found.median, found.sd, strict=True
        )
    ]
    return {
        "schema": SCHEMA,
        "spec": spec.path.name,
        "simulated": spec.simulated,
        "usable": all(one.ok for one in checks),
        "checks": [one.values() for one in checks],
        "quantities": quantities,
        "records": [_record(one, quantities) for one in found.ranked],
        "solver": None if solver is None else solver.values(),
        "seed": seed,
        **taken(spec, problem, listed(problem, known.found.aside)),
    }


def _law(known: Searched) -> Check:
    """Whether the law that the points are drawn from covers the posterior."""
    shape = known.weights.pareto_k
    ok = shape < UNRELIABLE
    return Check(
        "posterior",
        ok,
        f"the law around the best fits covers the posterior: Pareto shape of its weights "
        f"{shape:.2f} (limit {UNRELIABLE})",
    )


def _record(one: Ranked, quantities: list[dict[str, Any]]) -> dict[str, Any]:
    return candidate(one.change, one.worth, one.beyond) | {
        "expected": [
            _expected(one, number, repeats, quantity)
            for number, quantity in enumerate(quantities)
            for repeats in range(len(REPEATS))
        ]
    }


def candidate(change: Change, worth: float, beyond: Beyond | None) -> dict[str, Any]:
    """What is said of a record that could be taken, whatever it is to tell."""
    settings = dataclasses.asdict(change)
    return {
        "record": change.says,
        **{name: settings[name] for name in ("like", *SETTINGS, "cost")},
        "worth": finite(worth),
        "beyond": None
        if beyond is None
        else {
            "what": beyond.what,
            "unit": UNITS.get(beyond.what, "1"),
            "reached": finite(beyond.reached),
            "limit": beyond.limit,
        },
    }


def _expected(one: Ranked, number: int, repeats: int, quantity: dict[str, Any]) -> dict[str, Any]:
    """The factor of the sd by so many records, with its spread over the posterior."""
    factor, (low, high) = one.expected(number, repeats), one.within(number, repeats)
    return {
        "quantity": quantity["name"],
        "records": REPEATS[repeats],
        "factor": finite(factor),
        "factor_q05": finite(low),
        "factor_q95": finite(high),
        "sd": finite(factor * quantity["sd"]),
    }


def as_csv(made: dict[str, Any]) -> str:
    """A row for each record, quantity and number of records."""
    heads = ("factor", "factor_q05", "factor_q95", "sd")
    rows = [
        (one["record"], one["cost"], told["quantity"], told["records"], *(told[h] for h in heads))
        for one in made["records"]
        for told in one["expected"]
    ]
    return csv_text(("record", "cost", "quantity", "records", *heads), rows)
