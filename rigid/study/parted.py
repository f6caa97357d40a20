"""Which record would tell which of two effects it is that a study's model lacks."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rigid.discovery.outcome import tied
from rigid.discovery.turn import Running, Turn, first_turn
from rigid.effects import AbstractEffect
from rigid.inference.reference_check import SolverCheck
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.io.files import write_text
from rigid.io.progress import stages
from rigid.likelihood.listing import given_priors
from rigid.localfit.reference_check import against_reference
from rigid.localfit.settled import state_of
from rigid.planning.elsewhere import possible
from rigid.planning.parting import Pair, Parting, between_effects
from rigid.planning.ranking import REPEATS
from rigid.report.content import Check
from rigid.report.made import made as provenance
from rigid.report.parted.output import Both, as_csv, as_dict
from rigid.report.parted.present import content, table
from rigid.report.parted.section import KIND
from rigid.report.section import write_report
from rigid.report.usability import optimum
from rigid.spec.sentences import unknown
from rigid.study.discovery import UNFINISHED, Question, agreement, best_fit, shelf_of
from rigid.study.result import CommandResult


@dataclass(frozen=True, eq=False)
class Parted(CommandResult):
    """Records that could be taken, the one that parts two effects best first.

    - `question`: spec, records, problem, all effects that could be missing. - `turn`: the fit
      without the two. - `both`: what they are. - `ranked`; `seed`.
    - `starts`: whether starts of the search agreed.
    """

    question: Question
    turn: Turn
    both: Both
    ranked: tuple[Parting, ...]
    seed: int
    starts: Check

    @cached_property
    def solver(self) -> SolverCheck | None:
        """The fit without the two, solved again by diffrax; None: nothing is solved."""
        return against_reference(self.turn.fit.local, self.seed)

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of plan-between.json."""
        local, solver = self.turn.fit.local, self.solver
        checks = [self.starts, optimum(state_of(local))]
        checks += [] if solver is None else [solver.check]
        made = as_dict(self.question.spec, local, self.both, self.ranked, checks, self.seed)
        return made | {"solver": None if solver is None else solver.values()}

    def table(self) -> str:
        """What the command prints."""
        return table(dict(self.result))

    def write(self, folder: Path) -> None:
        """Write plan-between.json, plan-between.csv and the report."""
        made, spec = dict(self.result), self.question.spec
        write_text(folder / "plan-between.json", self.json())
        write_text(folder / "plan-between.csv", as_csv(made))
        read = [(r.path.name, r.sha256) for r in self.question.records]
        write_report(KIND, content(spec, made, provenance(spec, self.seed, read)), folder)


def part(asked: Question, names: tuple[str, str], seed: int, options: Options) -> Parted:
    """Fit the model as specified, and rank records by how far they part two effects.

    - `asked`: its effects are those that could be missing. - `names`: of the two.

    Raises InputError for an effect that could not be missing, or a record or a setting that is not
    there.
    """
    spec, problem = asked.spec, asked.problem
    effects = _named(asked, names)
    known = possible(spec, asked.records, problem)
    shelf = shelf_of(asked, seed, options)
    best = best_fit(asked, seed, options, shelf)
    with stages(options.quiet) as follow:
        at = best.z, best.standard
        turn = first_turn(problem, at, effects, given_priors(spec), Running(seed, follow, shelf))
        found = turn.found
        first, other = sorted(names, key=lambda name: -found.effects[name])
        two = tied(found, first, other)
        follow("weigh records")
        pair = Pair(turn.fit.local, turn.fit.programs, *two)
        ranked = between_effects(pair, known, REPEATS)
    shelf.clear(*UNFINISHED)
    logs = found.effects[first], found.effects[other]
    both = Both((first, other), logs, two.both[0], two.amplitude)
    return Parted(asked, turn, both, ranked, seed, agreement(best))


def _named(asked: Question, names: tuple[str, str]) -> tuple[type[AbstractEffect], ...]:
    """The two effects.

    Raises InputError for one that could not be missing, or the same twice.
    """
    listed = {effect.name: effect for effect in asked.effects}
    where = f"{asked.spec.path} --between"
    for name in names:
        if name not in listed:
            why = "it could not be missing from this model; " if listed else ""
            raise InputError(f"{where}: {why}{unknown('effect', name, listed)}")
    if names[0] == names[1]:
        raise InputError(f"{where}: '{names[0]}' twice; name two effects")
    return tuple(listed[name] for name in names)
