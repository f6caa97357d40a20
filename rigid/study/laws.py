"""Which friction model a study's records speak for."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rigid.friction.comparison import Comparison, compare, next_record
from rigid.friction.fits import fit_laws
from rigid.friction.models import models
from rigid.inference.calibrate import fingerprint
from rigid.inference.reference_check import SolverCheck
from rigid.io.cache import Shelf
from rigid.io.cli import Options
from rigid.io.files import write_text
from rigid.io.progress import stages
from rigid.likelihood.effect_lookup import marks
from rigid.likelihood.listing import given_priors
from rigid.likelihood.problem import Problem
from rigid.localfit.reference_check import against_reference
from rigid.records.record import Record
from rigid.report.laws.output import as_csv, as_dict
from rigid.report.laws.present import content, table
from rigid.report.laws.section import KIND
from rigid.report.made import made as provenance
from rigid.report.section import write_report
from rigid.spec import Spec
from rigid.study.result import CommandResult

KEPT = "unfinished-laws"
"""Folder of fits and comparisons, until the run is done."""


@dataclass(frozen=True, eq=False)
class Laws(CommandResult):
    """A comparison of friction models.

    - `spec`; `records`: as read; `comparison`: all that was worked out; `seed`.
    """

    spec: Spec
    records: tuple[Record, ...]
    comparison: Comparison
    seed: int

    @cached_property
    def solver(self) -> SolverCheck | None:
        """The first model's fit, solved again by diffrax; None: nothing is solved."""
        return against_reference(self.comparison.first.local, self.seed)

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of laws.json."""
        further = next_record(self.comparison)
        return as_dict(self.spec, self.comparison, further, self.seed, self.solver)

    def table(self) -> str:
        """What the command prints."""
        return table(dict(self.result))

    def write(self, folder: Path) -> None:
        """Write laws.json, laws.csv and the report."""
        made = dict(self.result)
        write_text(folder / "laws.json", self.json())
        write_text(folder / "laws.csv", as_csv(made))
        read = [(r.path.name, r.sha256) for r in self.records]
        this = content(self.spec, made, provenance(self.spec, self.seed, read))
        write_report(KIND, this, folder)
        Shelf(folder / KEPT).clear()


def compare_laws(
    spec: Spec, records: tuple[Record, ...], problem: Problem, seed: int, options: Options
) -> Laws:
    """Fit every friction model and compare them.

    - `problem`: of spec and records, without friction. - `options`: whether progress is told; `out`
      keeps what takes long until the files are written.
    """
    mark = fingerprint(spec, records, seed) | marks(problem.effects)
    shelf = Shelf(None if options.out is None else options.out / KEPT, mark, options.resume)
    with stages(options.quiet) as follow:
        fitted = fit_laws(problem, models(spec, problem), given_priors(spec), seed, follow, shelf)
        follow("compare")
        return Laws(spec, records, compare(fitted, seed, shelf), seed)
