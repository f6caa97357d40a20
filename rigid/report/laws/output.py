"""laws.json and laws.csv: how the laws of friction stand."""

from typing import Any

from rigid.friction.comparison import CANNOT_TELL, Comparison, Standing
from rigid.friction.prior_widths import AS_STATED
from rigid.inference.reference_check import SolverCheck
from rigid.io.files import csv_text, finite
from rigid.localfit.leave_one_out import gap
from rigid.localfit.samples import aside_of
from rigid.localfit.settled import state_of
from rigid.localfit.trust_region import promised
from rigid.planning.parting import Parting
from rigid.report.noise_found import noise_found
from rigid.report.taken import taken
from rigid.report.usability import optimum, residuals_of
from rigid.spec import Spec

SCHEMA = 1


def as_dict(
    spec: Spec,
    found: Comparison,
    further: Parting | None,
    seed: int,
    solver: SolverCheck | None = None,
) -> dict[str, Any]:
    """What goes to laws.json; log evidences and densities are differences to the first law."""
    left_over, added = gap(found.first.local), found.first.local.hypothesis.added
    listed = checks(found, solver)
    return {
        "schema": SCHEMA,
        "spec": spec.path.name,
        "simulated": spec.simulated,
        "joint": found.first.model.place.joint or None,
        "usable": all(one["ok"] for one in listed),
        "checks": listed,
        "verdict": found.verdict,
        "law": found.first.model.name if found.verdict != CANNOT_TELL else None,
        "first": found.first.model.name,
        "tied": [one.model.name for one in found.tied],
        "next_record": None
        if further is None
        else {"record": further.words, "apart": finite(further.apart[0])},
        "gap": finite(left_over),
        "laws": [_law(one, found) for one in found.standings],
        "solver": None if solver is None else solver.values() | {"says": solver.says},
        "seed": seed,
        "noise": noise_found(found.first.local),
        **taken(spec, found.first.local.layout.problem, aside_of(found.first.local.layout), added),
    }


def checks(found: Comparison, solver: SolverCheck | None) -> list[dict[str, Any]]:
    """What must hold for the comparison to be used, of the first law's fit."""
    local = found.first.local
    listed = [residuals_of(local), optimum(state_of(local))]
    listed += [] if solver is None else [solver.check]
    return [one.values() for one in listed]


def _law(one: Standing, found: Comparison) -> dict[str, Any]:
    first = found.first
    return {
        "law": one.model.name,
        "words": one.model.words,
        "effects": list(one.model.effects),
        "log_evidence": finite(one.evidence[AS_STATED] - first.evidence[AS_STATED]),
        "log_evidence_error": finite(one.odds_error),
        "log_evidence_laplace": finite(one.local.log_evidence - first.local.log_evidence),
        "probability": finite(one.probability[AS_STATED]),
        "priors": {
            name: {
                "log_evidence": finite(one.evidence[name] - first.evidence[name]),
                "probability": finite(one.probability[name]),
            }
            for name in one.evidence
        },
        "elpd_difference": finite(one.elpd),
        "elpd_error": finite(one.error),
        "elpd_expected": finite(one.expected),
        "tied": one.tied,
        "records": [
            {
                "record": part,
                "elpd_difference": finite(float(difference)),
                "elpd_error": finite(float(error)),
                "refitted": bool(refitted),
            }
            for part, difference, error, refitted in zip(
                found.parts, one.difference, one.errors, one.left.refitted, strict=True
            )
        ],
        "gap": finite(gap(one.local)),
        "short_of_top": finite(promised(one.local)),
        "parameters": {
            one.model.calls.get(label, label): one.local.interval(label)
            for label in own_labels(one)
        },
    }


def own_labels(one: Standing) -> list[str]:
    """Labels of a law's uncertain numbers of friction, the viscous coefficient's among them."""
    model = one.model
    names = {label for name in model.effects for label in model.place.labels(name)}
    return [
        label for label in one.local.hypothesis.labels if model.calls.get(label, label) in names
    ]


COLUMNS = (
    "law", "log_evidence", "log_evidence_error", "probability", "elpd_difference", "elpd_error",
    "tied",
)  # fmt: skip


def as_csv(made: dict[str, Any]) -> str:
    """What goes to laws.csv, a row a law.

    After COLUMNS: the probability under every width of the priors, and what every left-out record
    says.
    """
    first = made["laws"][0]
    priors = list(first["priors"])
    records = [one["record"] for one in first["records"]]
    rows = (
        (
            *(law[name] for name in COLUMNS),
            *(law["priors"][p]["probability"] for p in priors),
            *(one["elpd_difference"] for one in law["records"]),
        )
        for law in made["laws"]
    )
    return csv_text([*COLUMNS, *(f"probability, {p}" for p in priors), *records], rows)
