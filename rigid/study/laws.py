"""Which friction model a study's records speak for."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from rigid.friction.comparison import Comparison, compare
from rigid.friction.fits import Asked, fit_laws
from rigid.friction.models import FrictionModel, Place, models, with_friction, without_friction
from rigid.inference.calibrate import fingerprint
from rigid.inference.few_starts import best_of_few
from rigid.inference.reference_check import SolverCheck
from rigid.io.cache import Shelf
from rigid.io.cli import Options
from rigid.io.files import write_text
from rigid.io.progress import stages
from rigid.likelihood.assemble import assemble
from rigid.likelihood.effect_lookup import marks
from rigid.likelihood.listing import given_priors
from rigid.likelihood.problem import Problem
from rigid.likelihood.sizes import usual_of
from rigid.localfit.reference_check import against_reference
from rigid.planning.elsewhere import Possible, possible
from rigid.planning.parting import Parting, Rivals, best, between_fits
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
SEARCH_STARTS = 6
"""Of each model at a joint of a machine, until two agree."""


@dataclass(frozen=True, eq=False)
class Laws(CommandResult):
    """A comparison of friction models.

    - `spec`; `records`: as read; `comparison`: all that was worked out; `seed`.
    - `known`: records that could be taken next.
    """

    spec: Spec
    records: tuple[Record, ...]
    comparison: Comparison
    seed: int
    known: Possible

    @cached_property
    def solver(self) -> SolverCheck | None:
        """The first model's fit, solved again by diffrax; None: nothing is solved."""
        return against_reference(self.comparison.first.local, self.seed)

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of laws.json."""
        further = next_record(self.comparison, self.known)
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


def next_record(found: Comparison, known: Possible) -> Parting | None:
    """Find the record that parts the first model best from the likeliest of those tied with it.

    None where nothing is tied or no record keeps the limits.
    """
    if not found.tied:
        return None
    first, other = found.first, found.tied[0]
    programs = found.fitted.programs
    rivals = Rivals(
        (first.local, other.local), (programs.of(first.model), programs.of(other.model))
    )
    return best(between_fits(rivals, known))


def compare_laws(
    spec: Spec,
    records: tuple[Record, ...],
    problem: Problem,
    place: Place,
    seed: int,
    options: Options,
) -> Laws:
    """Fit every friction model and compare them.

    - `problem`: of spec and records, without friction at `place`. - `options`: whether progress is
      told; `out` keeps what takes long until the files are written.

    Raises InputError where [plan] names a record or a setting that is not there.
    """
    place = replace(place, usual=usual_of(spec, problem))
    known = possible(without_friction(spec, place), records, problem)
    mark = fingerprint(spec, records, seed) | marks(problem.effects) | {"joint": place.joint}
    shelf = Shelf(None if options.out is None else options.out / KEPT, mark, options.resume)
    with stages(options.quiet) as follow:
        search = None if place.machine is None else partial(_searched, spec, records, seed)
        given = given_priors(spec)
        asked = Asked(problem, models(spec, given, place), given, seed, search)
        fitted = fit_laws(asked, follow, shelf)
        follow("compare")
        return Laws(spec, records, compare(fitted, seed, shelf), seed, known)


def _searched(
    spec: Spec, records: tuple[Record, ...], seed: int, model: FrictionModel
) -> dict[str, float]:
    """Most probable numbers of a machine with a model of friction at its joint, z by label.

    A machine's friction may carry most of what is read, unlike the rig's: a climb from the fit
    without it then ends on the way.
    """
    problem = assemble(with_friction(spec, model.place, model.effects), records)
    found = best_of_few(problem, SEARCH_STARTS, seed)
    return dict(zip(problem.parameters.labels, found.z.tolist(), strict=True))
