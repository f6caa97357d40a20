"""Simulation-based calibration of a study: replicates as jobs, and what came of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from rigid.inference.summary import Check
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.io.files import write_text
from rigid.jobs.job import Job
from rigid.jobs.rows import read_rows
from rigid.jobs.run import run, told
from rigid.records.record import Record
from rigid.report.made import made as provenance
from rigid.report.section import write_report
from rigid.report.validation.output import as_dict
from rigid.report.validation.present import content, table
from rigid.report.validation.section import kind
from rigid.smoothing.laws import read_law
from rigid.spec import Spec
from rigid.study.alarms import count_alarms
from rigid.study.result import CommandResult
from rigid.validation.agreement import Agreement, agreement
from rigid.validation.campaign import Base, standard
from rigid.validation.design import (
    BREAKS,
    FAST,
    FITS,
    FULL,
    IGNORED,
    SLOPES,
    Design,
    arguments,
)
from rigid.validation.misfit import Effect, effects
from rigid.validation.replicate import one
from rigid.validation.verdict import Verdict, verdict

AROUND = 3.0
"""Width of priors that are moved to a posterior, in its own sds, at most that of the prior."""
FOLDER = "validation"


@dataclass(frozen=True)
class Replicates:
    """What a validation is asked.

    - `count`: campaigns. - `fit`: "fast"; "full", as the command does; "slopes", none at all: the
      likelihood's slope at the truth is tested alone, in seconds a campaign.
    - `posterior`: a posterior.nc around which campaigns are drawn; None: from the priors.
    - `misfit`: prior sds by which a constant of the rig is drawn from elsewhere, each in turn.
    - `broken`: break the likelihood on purpose, one of "noise-halved", "rounding-ignored",
      "colour-ignored", "record-twice".
    - `discover`: campaigns of which discovery is asked what is missing, though nothing is.
    """

    count: int = 100
    fit: str = FAST
    posterior: Path | str | None = None
    misfit: float = 0.0
    broken: str | None = None
    discover: int = 0

    def __post_init__(self) -> None:
        if self.broken is not None and self.broken not in BREAKS:
            raise InputError(f"broken = {self.broken!r}: it is one of {', '.join(BREAKS)}")
        if self.fit not in FITS:
            raise InputError(f"fit = {self.fit!r}: it is one of {', '.join(FITS)}")
        if self.fit == SLOPES and (self.misfit or self.discover or self.broken == IGNORED):
            raise InputError(
                "slopes at truths say nothing of a misfit, of discover or of colour-ignored, which "
                "are faults of a fit: leave them out, or fit"
            )
        if self.count < 1:
            raise InputError(f"{self.count} replicates: at least 1 is needed")
        if self.discover and (self.misfit or self.broken):
            raise InputError(
                "discover counts alarms on campaigns from which nothing is missing: leave out "
                "misfit and broken"
            )


@dataclass(frozen=True, eq=False)
class Validation(CommandResult):
    """What a validation found.

    - `spec`; `records`: as read. - `verdict`: tests and checks. - `effects`: of a misfit.
    - `beside`: the fast mode's error, None where no campaign was fitted both ways.
    """

    spec: Spec
    records: tuple[Record, ...]
    verdict: Verdict
    effects: tuple[Effect, ...]
    beside: Agreement | None

    @property
    def usable(self) -> bool:
        """Whether the spec's posteriors can be trusted; a misfit is asked for, and no fault."""
        return bool(self.verdict.design.shift) or self.verdict.usable

    @property
    def checks(self) -> tuple[Check, ...]:
        """What does not hold, unless it was asked for."""
        return () if self.usable else super().checks

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of validation.json."""
        return as_dict(self.spec, self.verdict, self.beside, self.effects)

    def table(self) -> str:
        """What the command prints."""
        return table(self.verdict, self.beside, self.effects)

    def write(self, folder: Path) -> None:
        """Write validation.json and the report."""
        design = self.verdict.design
        words = [design.broken] if design.broken else ["misfit"] if design.shift else []
        name = "-".join(["validation", *words])
        write_text(folder / f"{name}.json", self.json())
        read = [(r.path.name, r.sha256) for r in self.records]
        cost = {"cpu_s": self.verdict.cpu_s}
        this = provenance(self.spec, design.seed, read, **cost)
        shown = content(self.spec, self.verdict, self.beside, self.effects, this)
        write_report(kind(name), shown, folder)


def validate(base: Base, asked: Replicates, seed: int, options: Options) -> Validation:
    """Run the replicates that have no row yet, and test all.

    - `base`: spec, records and problem. - `options`: `out` is the folder that keeps rows, None:
      none are kept; `resume`, `quiet` and `workers` as on the command line.

    Raises InputError for a posterior that is not of this spec's parameters.
    """
    around = {} if asked.posterior is None else around_of(base, Path(asked.posterior))
    design = Design(seed, asked.fit, asked.broken, 0.0, asked.misfit, around)
    spec = base.spec
    files = tuple(dict.fromkeys(r.path.absolute() for r in base.records))
    jobs = [
        Job(f"{design.name}-{number}", arguments(spec, design, number), files)
        for number in range(asked.count)
    ]
    kept = None if options.out is None else options.out / FOLDER
    path = None if kept is None else kept / f"{design.name}.jsonl"
    with told(options, "replicates", len(jobs)) as report:
        rows = list(run(one, jobs, options.workers, path, resume=options.resume, report=report))
    used = [r["value"] for r in rows if r["failed"] is None and r["value"]["good"]]
    found = verdict(design, rows)
    if asked.discover:
        counted = count_alarms(base, asked.discover, design, replace(options, out=kept))
        found = replace(found, alarms=counted)
    return Validation(
        spec=spec,
        records=base.records,
        verdict=found,
        effects=effects(used) if design.shift else (),
        beside=_beside(kept, design, used),
    )


def _beside(kept: Path | None, design: Design, used: list[dict[str, Any]]) -> Agreement | None:
    """Rows of this run beside those of the other mode in the same folder."""
    if kept is None or design.fit == SLOPES:
        return None
    other = replace(design, fit=FAST if design.fit == FULL else FULL)
    rows = read_rows(kept / f"{other.name}.jsonl")
    beside = [row["value"] for row in rows if row["failed"] is None]
    return agreement(beside, used) if design.fit == FULL else agreement(used, beside)


def around_of(base: Base, path: Path) -> dict[str, tuple[float, float]]:
    """Centre and width, in prior sds, of priors that are moved to a posterior.

    Raises InputError where the posterior is of another rig or lacks a parameter.
    """
    values = read_law(base.spec, path, np.random.default_rng(0)).values
    out = {}
    for parameter in base.problem.parameters.sampled:
        if parameter.label not in values:
            raise InputError(
                f"{path}: has no {parameter.label}; --from takes the posterior of this very spec"
            )
        z = standard(parameter.prior, values[parameter.label])
        out[parameter.label] = (float(np.mean(z)), float(min(1.0, AROUND * np.std(z))))
    return out
