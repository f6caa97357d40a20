"""A turn of discovery: a fit, what is weighed around it, and fits with what explains most."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rigid.discovery.base_fit import begun_at, led_on
from rigid.discovery.fitted import Fitted
from rigid.discovery.near import held_near, let_go
from rigid.discovery.refit import (
    NO_LEAD,
    InitialGuess,
    Lead,
    Refit,
    begin,
    guess_of,
    lead_of,
    refit,
)
from rigid.discovery.signatures import Bench, laid_out
from rigid.discovery.weighing.explain import Explained, explain
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.ascent import refined
from rigid.localfit.families import Effects, families
from rigid.localfit.local import LocalFit, fitted_noise, with_noise, with_weights
from rigid.localfit.screening import Around, screen
from rigid.localfit.weights import facts

Report = Callable[[str], None]


class Running(NamedTuple):
    """How a run goes.

    - `seed`. - `report`: is told each stage. - `shelf`: keeps what takes long.
    """

    seed: int
    report: Report = lambda _: None
    shelf: Shelf = NOTHING_KEPT


def weigh(local: LocalFit, bench: Bench, seed: int) -> Explained:
    """Weigh every explanation of what a fit leaves over.

    Effects that are in it are left out, and laws that share a number with one of them: another dry
    friction would take the place of the first, not come beside it.
    """
    inside = {info.name for effect in local.hypothesis.added for info in effect.parameters()}
    kept = [
        i
        for i, one in enumerate(bench.listed)
        if not inside & {info.name for info in one.effect.parameters()}
    ]
    around = Around(local.terms.score, local.terms.curvature, local.design, local.gradient)
    columns = np.array([*kept, *range(len(bench.listed), bench.signatures.shape[1])])
    listed = tuple(bench.listed[i] for i in kept)
    found = screen(around, bench.signatures).only(columns)
    return explain(listed, bench.bumps.target, found, seed)


@dataclasses.dataclass(frozen=True)
class Turn:
    """One turn of the workflow: a fit, and what is weighed around it.

    - `before`: evidence for the effects that were added before it, in nats.
    """

    fit: Fitted
    bench: Bench
    running: Running
    before: float = 0.0

    @cached_property
    def found(self) -> Explained:
        """Every explanation of what the fit leaves over."""
        return weigh(self.fit.local, self.bench, self.running.seed)

    @cached_property
    def near(self) -> "Turn | None":
        """The same around a fit that is held near its priors; None where that has not left them."""
        local = held_near(self.fit.local)
        if local is None:
            return None
        self.running.report("signatures near the priors")
        fit = Fitted(local, self.fit.programs)
        effects = tuple(dict.fromkeys(one.effect for one in self.bench.listed))
        running = self.running._replace(shelf=NOTHING_KEPT)
        return Turn(fit, laid_out(fit, effects, NOTHING_KEPT), running)

    def refits(
        self,
        names: Sequence[str],
        lead: Lead = NO_LEAD,
        near: "Turn | None" = None,
        twin: Refit | None = None,
    ) -> dict[str, Refit]:
        """Fit the model with each of some effects added, the one first that comes furthest.

        - `lead`: of an effect that was fitted before. - `near`: where the effects were weighed, and
          the fits begin, if not around the fit itself. - `twin`: with an effect of the same
          signature, or with the effect beside others, where they begin.
        """
        at, guess, begun = (
            near or self,
            None if twin is None else guess_of(twin, self.fit.local),
            {},
        )
        if near is not None:
            guess = InitialGuess(let_go(near.fit.local, self.fit.local))
        for name in names:
            self.running.report(f"fit with {name}")
            begun[name] = begin(self.fit, at.found, name, guess)
        out: dict[str, Refit] = {}
        for name in sorted(names, key=lambda name: -begun[name].height):
            one = refit(self.fit, at.found, begun[name], lead, at.running.shelf)
            out[name] = dataclasses.replace(one, earlier=self.before)
            lead = max(lead, lead_of(name, out[name]), key=lambda one: one.height)
        return {name: out[name] for name in names}

    def after(self, one: Refit) -> "Turn":
        """Return the turn that follows where an effect was added."""
        self.running.report(f"residuals with {one.candidate.effect.name}")
        return dataclasses.replace(
            self, fit=Fitted(one.after, self.fit.programs), before=self.before + one.log_bayes
        )


def first_turn(
    problem: Problem,
    best: tuple[np.ndarray, np.ndarray],
    effects: Effects,
    given: Mapping[str, AbstractPrior],
    running: Running,
) -> Turn:
    """Fit the model as specified and work out what each candidate would leave; as in `discover`."""
    report = running.report
    programs = families(problem, effects)
    report("fit the model as specified")
    base = led_on(begun_at(problem, programs[0], best, given))
    base = with_weights(base, base.layout.read.astype(float))
    base = with_noise(base, fitted_noise(base))
    report("signatures of candidates")
    bench = laid_out(Fitted(base, programs), effects, running.shelf)
    base = refined(with_weights(base, facts(base, bench.traces)))
    return Turn(Fitted(base, programs), bench, running)
