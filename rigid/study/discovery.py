"""What is missing from a study's model: the search, the workflow, and what came of them."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, TypeVar

from rigid.discovery.base_fit import best_base
from rigid.discovery.outcome import Outcome
from rigid.discovery.refit import KEPT as REFITS
from rigid.discovery.signatures import KEPT
from rigid.discovery.turn import Running
from rigid.discovery.unmodelled import SORTS
from rigid.discovery.workflow import discover as work
from rigid.effects import CATALOGUE, AbstractEffect
from rigid.inference.calibrate import fingerprint
from rigid.inference.few_starts import Best
from rigid.inference.reference_check import SolverCheck
from rigid.io.cache import Shelf
from rigid.io.cli import Options
from rigid.io.files import write_text
from rigid.io.progress import stage, stages
from rigid.likelihood.assemble import require_at_work
from rigid.likelihood.effect_lookup import effects_named, marks
from rigid.likelihood.listing import given_priors
from rigid.likelihood.machine import everywhere
from rigid.likelihood.problem import Problem
from rigid.likelihood.sizes import of_its_size, usual_of
from rigid.localfit.families import families
from rigid.localfit.reference_check import against_reference
from rigid.planning.elsewhere import Possible, possible
from rigid.planning.parting import Pair, best, between_effects
from rigid.records.record import Record
from rigid.report.content import Check
from rigid.report.discovery import compared, output
from rigid.report.discovery.present import Context, content
from rigid.report.discovery.section import KIND
from rigid.report.discovery.terminal import table
from rigid.report.made import made
from rigid.report.section import write_report
from rigid.report.usability import optimum, residuals_of
from rigid.spec import Spec, parse_spec
from rigid.study.result import CommandResult

Opened = TypeVar("Opened")

UNFINISHED = (KEPT, REFITS)
"""Folders of a run under way."""
STARTS = 8
"""Starts of the search, at most: mostly the first two agree."""


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked: records, the problem they make, and what could be missing from it."""

    spec: Spec
    records: tuple[Record, ...]
    problem: Problem
    effects: tuple[type[AbstractEffect], ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the readers had to say of the records."""
        return tuple(f"{r.name},{r.cylinder}: {note}" for r in self.records for note in r.notes)


@dataclass(frozen=True, eq=False)
class Discovery(CommandResult, Generic[Opened]):
    """What was found missing.

    - `question`; `outcome`: all that was weighed; `seed`.
    - `starts`: whether starts of the search agreed.
    - `opened`: what makes a study of a spec.
    - `folder`: where the files are to lie; None: nowhere, files are named from the spec's folder.
    """

    question: Question
    outcome: Outcome
    seed: int
    starts: Check
    opened: Callable[[Spec], Opened]
    folder: Path | None = None

    @property
    def verdict(self) -> str:
        """One of "nothing-missing", "named", "indistinguishable", "unnamed"."""
        return self.outcome.verdict

    @property
    def steps(self) -> list[dict[str, Any]]:
        """Entries of `steps` in discovery.json: where, effect, probability, alternatives, ..."""
        return self.result["steps"]

    @property
    def extended(self) -> Opened | None:
        """The study of the spec with the effects that were found; None where none was."""
        if not self._extends:
            return None
        folder = self._spec.path.parent
        text = output.extended_spec(self._spec, self.outcome, folder)
        name = f"{self._spec.path.stem}-{output.SPEC_NAME}"
        return self.opened(parse_spec(text, folder / name))

    @cached_property
    def solver(self) -> SolverCheck | None:
        """The fit with all that was added, solved again by diffrax; None: nothing is solved."""
        return against_reference(self.outcome.final, self.seed)

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of discovery.json."""
        extended = None
        if self._extends and self.folder is not None:
            extended = self.folder / output.SPEC_NAME
        told = output.as_dict(self._spec, self.outcome, extended)
        solver = None if self.solver is None else self.solver.values()
        final = self.outcome.final
        checks = [self.starts, residuals_of(final), optimum(self.outcome.settled)]
        checks += [] if self.solver is None else [self.solver.check]
        return told | {
            "usable": all(one.ok for one in checks),
            "checks": [one.values() for one in checks],
            "disagreements": compared.told(self._compared),
            "solver": solver,
        }

    def table(self) -> str:
        """What the command prints."""
        return table(dict(self.result))

    def write(self, folder: Path) -> None:
        """Write discovery.json, the spec with what was found, and the report."""
        if self._extends:
            text = output.extended_spec(self._spec, self.outcome, folder)
            write_text(folder / output.SPEC_NAME, text)
        write_text(folder / "discovery.json", self.json())
        provenance = made(
            self._spec,
            self.seed,
            [(r.path.name, r.sha256) for r in self.question.records],
        )
        this = Context(provenance, self.question.notes, self._compared, self.checks)
        write_report(KIND, content(self._spec, self.outcome, dict(self.result), this), folder)

    @property
    def _spec(self) -> Spec:
        return self.question.spec

    @property
    def _extends(self) -> bool:
        return any(step.chosen for step in self.outcome.steps)

    @cached_property
    def _compared(self) -> compared.Compared:
        return compared.compared(self.outcome, self.seed)


def candidates(spec: Spec, problem: Problem) -> tuple[type[AbstractEffect], ...]:
    """Effects that could be missing: those the spec names, or the catalogue, where they act."""
    named = spec.model.candidates
    listed = tuple(CATALOGUE.values())
    if named is not None:
        listed = effects_named(named, spec.path.parent, f"{spec.path} [model] candidates")
    if spec.machine is not None:
        listed = everywhere(spec.machine, listed)
    else:
        if named is not None:
            require_at_work(spec, listed, problem.tracks, "candidates")
        listed = of_its_size(listed, usual_of(spec, problem))
    kinds = {track.kind for track in problem.tracks}
    taken = {label for effect in problem.effects for label in effect.labels()}
    return tuple(
        effect
        for effect in listed
        if effect not in problem.effects
        and any(effect.acts_in(kind) for kind in kinds)
        and effect.may_lack()
        and taken.isdisjoint(effect.labels())
    )


def answer(
    asked: Question, seed: int, options: Options, opened: Callable[[Spec], Opened]
) -> Discovery[Opened]:
    """Search the best fit of the model as specified, and run the workflow from there.

    - `opened`: what makes a study of a spec.
    - `options`: `out` is the folder that keeps what takes long, None: none does.

    Raises InputError where [plan] names a record or a setting that is not there.
    """
    spec = asked.spec
    shelf = shelf_of(asked, seed, options)
    known = possible(spec, asked.records, asked.problem)  # a mistake in [plan] is told first
    found = best_fit(asked, seed, options, shelf)
    best = found.z, found.standard
    with stages(options.quiet) as follow:
        running = Running(seed, follow, shelf)
        outcome = work(asked.problem, best, asked.effects, given_priors(spec), running)
        outcome = _with_next_records(outcome, known)
    shelf.clear(*UNFINISHED)  # tens of megabytes that only a run under way needs
    return Discovery(asked, outcome, seed, agreement(found), opened, options.out)


def _with_next_records(outcome: Outcome, known: Possible) -> Outcome:
    """Say of every step at which two effects are tied which record would part them best."""
    steps = []
    for number, step in enumerate(outcome.steps):
        # What has no name may show in a record to come as well, and no one knows how.
        if step.tied is not None and not outcome.before(number).hypothesis.absorbed:
            pair = Pair(outcome.before(number), outcome.programs, *step.tied)
            record = best(between_effects(pair, known))
            step = dataclasses.replace(step, next_record=record and record.sentence)
        steps.append(step)
    return dataclasses.replace(outcome, steps=tuple(steps))


def agreement(found: Best) -> Check:
    """Whether the search is to be believed: two of its starts ended in one place."""
    agree = "two" if found.agree else "no two"
    said = f"{agree} of {found.starts} starts ended in the best optimum"
    if found.starts == 1:
        said = "one start alone: none could disagree"
    return Check("starts", found.agree or found.starts == 1, said)


def shelf_of(asked: Question, seed: int, options: Options) -> Shelf:
    """What of a run is kept while it is under way."""
    return Shelf(options.out, _mark(asked, seed), options.resume)


def _mark(asked: Question, seed: int) -> dict[str, str]:
    """What the search and the traces depend on."""
    listed = " ".join(effect.name for effect in asked.effects)
    effects = (*asked.problem.effects, *asked.effects)
    return (
        fingerprint(asked.spec, asked.records, seed)
        | marks(effects)
        | {
            "candidates": listed,
            "hidden": " ".join(SORTS),
        }
    )


def best_fit(asked: Question, seed: int, options: Options, shelf: Shelf) -> Best:
    """Search the best fit of the model as specified; a run that goes on finds it on the shelf."""

    def search() -> Best:
        starts = min(asked.spec.sampler.starts, STARTS)
        with stage(options.quiet, "search", starts, "starts") as shown:
            program = families(asked.problem, asked.effects)[0]
            return best_base(asked.problem, program, starts, seed, shown.reach)

    return shelf.once("discovery-search", search, (Best,))
