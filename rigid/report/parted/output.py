"""plan-between.json and .csv: records that could be taken, and how far each parts two effects."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from rigid.io.files import csv_text, finite
from rigid.localfit.candidates import Candidate, priors_of
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import aside_of
from rigid.planning.parting import Parting, told
from rigid.planning.ranking import REPEATS
from rigid.report.content import Check
from rigid.report.plan.output import candidate
from rigid.report.taken import taken
from rigid.spec import Spec

SCHEMA = 1


class Both(NamedTuple):
    """Two effects, the likelier first.

    - `names`; `log_bayes`: of each against its absence. - `first`: where it explains most;
      `estimate`: its amplitude there.
    """

    names: tuple[str, str]
    log_bayes: tuple[float, float]
    first: Candidate
    estimate: float


def as_dict(
    spec: Spec,
    local: LocalFit,
    both: Both,
    ranked: tuple[Parting, ...],
    checks: Sequence[Check],
    seed: int,
) -> dict[str, Any]:
    """What goes to plan-between.json; SI."""
    (first, other), logs = both.names, both.log_bayes
    return {
        "schema": SCHEMA,
        "spec": spec.path.name,
        "simulated": spec.simulated,
        "usable": all(one.ok for one in checks),
        "checks": [one.values() for one in checks],
        "between": {
            "first": first,
            "other": other,
            "log_bayes": {first: finite(logs[0]), other: finite(logs[1])},
            "amplitude": _amplitude(both),
        },
        "now": _told(0, ranked[0].now if ranked else 0.0),
        "records": [_record(one) for one in ranked],
        "seed": seed,
        **taken(spec, local.layout.problem, aside_of(local.layout)),
    }


def _amplitude(both: Both) -> dict[str, Any]:
    """The number that brings the first effect in, as the records have it."""
    one = both.first
    by = 1.0 if one.level is None else one.level
    unit = priors_of(one.effect, {})[one.amplitude][0].unit
    return {"name": one.amplitude, "value": finite(one.absent + by * both.estimate), "unit": unit}


def _record(one: Parting) -> dict[str, Any]:
    expected = [_told(count, far) for count, far in zip(REPEATS, one.apart, strict=True)]
    return candidate(one.change, one.worth, one.beyond) | {"expected": expected}


def _told(count: int, apart: float) -> dict[str, Any]:
    """How far apart the two are with so many records, and how often they are told apart."""
    return {"records": count, "apart": finite(apart), "told": finite(told(apart))}


def as_csv(made: dict[str, Any]) -> str:
    """A row for each record and number of records."""
    rows = [
        (one["record"], one["cost"], told["records"], told["apart"], told["told"])
        for one in made["records"]
        for told in one["expected"]
    ]
    return csv_text(("record", "cost", "records", "apart", "told"), rows)
