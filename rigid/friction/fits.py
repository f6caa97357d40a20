"""Every model fitted to the records, in two programs: viscous friction, and dry friction."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigid.friction.models import BRISTLES, MEMORY, VISCOUS, FrictionModel
from rigid.friction.starts import (
    constant_starts,
    dry_starts,
    larger_start,
    memory_starts,
    prior_starts,
    searched_start,
)
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.likelihood.priors import LAWS, AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.ascent import MOST_TURNS, descended, led, refined, settled
from rigid.localfit.expansion import Point, expand
from rigid.localfit.families import Family, families
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.local import LocalFit
from rigid.localfit.noise.leftover import Traces
from rigid.localfit.noise.weights import facts
from rigid.localfit.samples import Layout, Terms, lay_out

STARTS = 4
"""Starts of the model with memory: the centre of its priors, and draws from them."""
FIRST_TURNS = 10
"""Turns of the program after which only the best start goes on."""
BEGINNINGS = {BRISTLES: 2}
"""Starts of a model of dry friction; one of the others."""
FIRST_DRY_TURNS = 2
"""Turns after which only the best start of each model of dry friction goes on."""
WIDTH = 24
"""Simulations side by side in the program of dry friction: a step of a model takes some 20."""

KINDS = (LocalFit, Hypothesis, Layout, Terms, *LAWS.values())
"""What fits are made of, beside dry friction."""

Report = Callable[[str], None]


class Programs(NamedTuple):
    """The compiled programs."""

    viscous: Family
    dry: Family

    def of(self, model: FrictionModel) -> Family:
        """The one that holds a model."""
        return self.viscous if model.dry is None else self.dry


@dataclasses.dataclass(frozen=True)
class FittedModels:
    """All models at their best, the same weights of samples in all.

    - `programs`; `models`. - `fits`: by name of the model.
    """

    programs: Programs
    models: tuple[FrictionModel, ...]
    fits: Mapping[str, LocalFit]


class Asked(NamedTuple):
    """What is fitted.

    - `problem`: with viscous friction and memory. - `models`. - `given`: priors that go before the
      effects' own, by label. - `seed`: of the starts. - `search`: finds the numbers of a model by
      itself, z by label; None: all begin beside the fit without dry friction.
    """

    problem: Problem
    models: tuple[FrictionModel, ...]
    given: Mapping[str, AbstractPrior]
    seed: int
    search: Callable[[FrictionModel], Mapping[str, float]] | None = None


def fit_laws(asked: Asked, report: Report, shelf: Shelf = NOTHING_KEPT) -> FittedModels:
    """Fit every model.

    - `shelf`: keeps the fits as they are made.

    How many facts a sample is gets judged once every model has had its say: what the best of them
    leaves over, and what none of them could take away, is noise.
    """
    problem, models, given, seed, search = asked
    frictions = tuple(dict.fromkeys(m.dry for m in models if m.dry is not None))
    kinds = (*KINDS, *frictions)
    plain = families(problem, (), together=True)[0]
    wide = dataclasses.replace(families(problem, frictions, together=True)[0], width=WIDTH)
    viscous, dry = programs = Programs(plain, wide)
    layout = lay_out(problem)
    layout = layout.weighed((layout.weight > 0.0).astype(float))
    known = {"problem": problem, "given": given, "plain": plain, "wide": wide}
    known |= {name: getattr(layout, name) for name in ("channels", "channel", "time")}
    listed = [model for model in models if model.dry is not None]
    beside = MEMORY if listed[0].memory else VISCOUS

    def viscous_fits() -> dict[str, LocalFit]:
        report("fit viscous friction")
        return _viscous(viscous, Hypothesis(problem, given=given), layout, models[0], seed)

    fits = shelf.once("viscous", viscous_fits, kinds, known)

    def dry_fits() -> tuple[dict[str, LocalFit], np.ndarray]:
        report("fit dry friction")
        base = fits[beside]
        starts = dry_starts(base, dry, listed, BEGINNINGS)
        begun = [(name, p) for name, points in starts.points.items() for p in points]
        if search is not None:
            report("search with dry friction")
            begun += [(one.name, searched_start(base, one, search(one))) for one in listed]
        return _to_the_end(dry, _dry(dry, begun), base, listed), starts.changes

    dry_ends, changes = shelf.once("dry", dry_fits, kinds, known)
    fits |= dry_ends

    def last_fits() -> dict[str, LocalFit]:
        report("fit all again")
        best = max(fits.values(), key=lambda one: one.log_evidence)
        counted = facts(best, Traces.of(changes))
        out = {name: counted.of(one) for name, one in fits.items()}
        names = VISCOUS, MEMORY
        ends = settled(viscous, [out[name] for name in names], MOST_TURNS)
        out |= dict(zip(names, ends, strict=True))
        return out | _to_the_end(dry, out, out[beside], listed)

    return FittedModels(programs, models, shelf.once("fits", last_fits, kinds, known))


def _viscous(
    program: Family, hypothesis: Hypothesis, layout: Layout, constant: FrictionModel, seed: int
) -> dict[str, LocalFit]:
    """Fits with memory, and without; with memory once more from the fit without.

    A model that contains another is never the worse for it: where its own starts have led nowhere,
    that of the other does.
    """
    memory = _best(program, prior_starts(hypothesis, layout, STARTS, seed))
    still = _best(program, constant_starts(memory, constant))
    again = _best(program, memory_starts(still, memory, constant.place))
    return {VISCOUS: still, MEMORY: max(memory, again, key=lambda one: one.value)}


def _best(program: Family, points: Sequence[Point]) -> LocalFit:
    """The best of several starts after a few turns, led to its end.

    Those at which nothing can be simulated are left out.
    """
    begun = [one for one in expand(program, points) if np.isfinite(one.value)]
    ends = descended(program, begun, FIRST_TURNS)
    return led(program, [max(ends, key=lambda one: one.value)])[0]


def _dry(program: Family, begun: Sequence[tuple[str, Point]]) -> dict[str, LocalFit]:
    """The best of each model's starts after a few turns."""
    here = expand(program, [point for _, point in begun])
    found: dict[str, LocalFit] = {}
    for (name, _), end in zip(begun, descended(program, here, FIRST_DRY_TURNS), strict=True):
        if name not in found or end.value > found[name].value:
            found[name] = end
    return found


def _to_the_end(
    program: Family, found: Mapping[str, LocalFit], base: LocalFit, listed: Sequence[FrictionModel]
) -> dict[str, LocalFit]:
    """Every model led to its optimum, the simplest first.

    One that contains another is never the worse for it: where the other has come higher it begins
    there.
    """
    out: dict[str, LocalFit] = {}
    for model in listed:
        own = found[model.name]
        points = [Point.beside(own, own.w)]
        inner = [out[one.name] for one in listed if one.name in out and model.contains(one)]
        if inner:
            best = max(inner, key=lambda one: one.value)
            points.append(larger_start(best, base, model))
        begun = [one for one in expand(program, points) if np.isfinite(one.value)]
        highest = max(begun, key=lambda one: one.value, default=own)
        out[model.name] = refined(highest)
    return out
