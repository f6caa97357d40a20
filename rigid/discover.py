"""`python -m rigid.discover SPEC`: where model and data disagree, and what is missing."""

import json
import sys
from typing import TYPE_CHECKING, NamedTuple

from rigid.io.cli import Options, run, say

if TYPE_CHECKING:
    from rigid.discovery.workflow import Outcome
    from rigid.effects import AbstractEffect
    from rigid.io.cache import Arrays
    from rigid.likelihood.problem import Problem
    from rigid.records.record import Record
    from rigid.spec import Spec

SAYS = "Find where model and data disagree, name the missing effect, add it, show the gap shrink."
STARTS = 4
"""Starts of the search, at most: a fit in earnest takes more."""


class Question(NamedTuple):
    """What is asked of a spec: its records, its problem, and what could be missing."""

    spec: "Spec"
    records: "tuple[Record, ...]"
    problem: "Problem"
    effects: "tuple[type[AbstractEffect], ...]"

    @property
    def notes(self) -> tuple[str, ...]:
        """What the readers had to say of the records."""
        return tuple(f"{r.name},{r.cylinder}: {note}" for r in self.records for note in r.notes)


def discover(options: Options) -> int:
    """Run the workflow and write its files; returns 0, or 1 if the result must not be used."""
    from rigid.spec import find_spec, load_spec

    spec = load_spec(find_spec(options.spec))
    say(options, f"spec {spec.path}: {len(spec.records)} records")
    asked = question(spec)
    from rigid.io.files import locked

    with locked(options.folder(spec.path)):
        return _written(asked, answer(asked, options), options)


def question(spec: "Spec") -> Question:
    """Read the records of a spec and list what could be missing from its model.

    Raises InputError for records and candidates that nothing answers to.
    """
    from rigid.io.runtime import prepare

    prepare()
    from rigid.likelihood.assemble import assemble
    from rigid.records.read import read_records

    records = read_records(spec)
    problem = assemble(spec, records)
    return Question(spec, records, problem, candidates(spec, problem))


def answer(asked: Question, options: Options) -> "Outcome":
    """Search the best fit of the model as specified, and run the workflow from there."""
    from rigid.discovery.signatures import KEPT
    from rigid.discovery.workflow import Running
    from rigid.discovery.workflow import discover as work
    from rigid.io.cache import Shelf
    from rigid.likelihood.assemble import given_laws

    spec, seed = asked.spec, _seed(asked.spec, options)
    shelf = Shelf(options.folder(spec.path), _mark(asked, seed), options.resume)
    found = shelf.once("discovery-search", lambda: _best(spec, asked.problem, options, seed))
    running = Running(seed, lambda text: say(options, text), shelf)
    best = found["z"], found["standard"]
    outcome = work(asked.problem, best, asked.effects, given_laws(spec), running)
    shelf.clear(KEPT)  # tens of megabytes that only a run under way needs
    return outcome


def _mark(asked: Question, seed: int) -> dict[str, str]:
    """What the search and the traces depend on."""
    from rigid.discovery.unmodelled import SORTS
    from rigid.inference.calibrate import fingerprint
    from rigid.likelihood.effect_lookup import marks

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


def _seed(spec: "Spec", options: Options) -> int:
    return spec.sampler.seed if options.seed is None else options.seed


def candidates(spec: "Spec", problem: "Problem") -> "tuple[type[AbstractEffect], ...]":
    """Effects that could be missing: those the spec names, or the catalogue, where they act."""
    from rigid.effects import CATALOGUE
    from rigid.likelihood.effect_lookup import effects_named

    named = spec.model.candidates
    listed = tuple(CATALOGUE.values())
    if named is not None:
        listed = effects_named(named, spec.path.parent, f"{spec.path} [model] candidates")
    kinds = {track.kind for track in problem.tracks}
    taken = {info.name for effect in problem.effects for info in effect.parameters()}
    return tuple(
        effect
        for effect in listed
        if effect not in problem.effects
        and any(effect.acts_in(kind) for kind in kinds)
        and any(info.absent is not None for info in effect.parameters())
        and not taken & {info.name for info in effect.parameters()}
    )


def _best(spec: "Spec", problem: "Problem", options: Options, seed: int) -> "Arrays":
    """Gaussian scale and standard sensors of the best fit, with a progress bar."""
    from tqdm import tqdm

    from rigid.inference.search import settled

    starts = min(spec.sampler.starts, STARTS)
    with tqdm(total=starts, disable=options.quiet, desc="starts") as bar:
        z, standard = settled(problem, starts, seed, lambda done: _advance(bar, done))
    return {"z": z, "standard": standard}


def _advance(bar, done: int) -> None:
    bar.update(done - bar.n)


def _written(asked: Question, outcome: "Outcome", options: Options) -> int:
    """Write every file and print the table or the JSON."""
    from rigid.io.files import write_text
    from rigid.report.discovery import compared, output
    from rigid.report.discovery.present import Run, content
    from rigid.report.discovery.section import write_report
    from rigid.report.discovery.terminal import table

    spec, folder = asked.spec, options.folder(asked.spec.path)
    extended = None
    if any(step.chosen for step in outcome.steps):
        extended = folder / output.SPEC_NAME
        write_text(extended, output.extended_spec(spec, outcome, folder))
    where = compared.compared(outcome, _seed(spec, options))
    made = output.as_dict(spec, outcome, extended) | {"disagreements": compared.told(where)}
    text = json.dumps(made, indent=1, allow_nan=False) + "\n"
    write_text(folder / "discovery.json", text)
    this = Run(_seed(spec, options), asked.notes, where)
    write_report(content(spec, outcome, made, this), folder)
    sys.stdout.write(text if options.as_json else table(made))
    say(options, f"report: {folder / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(run("discover", SAYS, discover))
