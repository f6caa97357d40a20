"""A turn of discovery: a fit, what is weighed around it, and fits with what explains most."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

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
from rigid.discovery.unmodelled.base import Inferred
from rigid.discovery.weighing.discrepancy import borne
from rigid.discovery.weighing.explain import NOTHING, PRIOR_NOTHING, Explained, explain
from rigid.discovery.weighing.odds import odds
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.ascent import refined
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import Effects, families
from rigid.localfit.hypothesis import Absorbed
from rigid.localfit.local import LocalFit, fitted_noise, with_noise, with_weights
from rigid.localfit.noise.follows import pooled, pooled_by
from rigid.localfit.noise.instants import asked_for
from rigid.localfit.noise.weights import facts
from rigid.localfit.screening import Around, screen
from rigid.localfit.settled import unsettled

Report = Callable[[str], None]
FEW = 6
"""Causes of unknown law that are weighed by both likelihoods."""
JITTER = math.log(0.1 / 0.9)
"""Log odds, before any record, that the instants of a logger's samples jitter."""


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
class Absorption:
    """A cause of unknown law, and fits without it and with it as a part of the model."""

    hidden: Inferred
    before: LocalFit
    after: LocalFit

    @cached_property
    def log_bayes(self) -> float:
        """Of it against its absence, at the size that explains most; pooled as a refit's."""
        change = pooled(self.before, self.after) if self.after.finite else 0.0
        return self.after.log_evidence - self.before.log_evidence + change

    @property
    def unsettled(self) -> str:
        """Why the fit with it cannot be believed, in a sentence; empty where it can."""
        return unsettled(self.after, self.before, borne(self.log_bayes))


@dataclasses.dataclass(frozen=True)
class Turn:
    """One turn of the workflow: a fit, and what is weighed around it.

    - `before`: evidence for what came in before it, in nats.
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
    def hidden(self) -> Inferred:
        """What the records say of the likeliest cause of unknown law."""
        likeliest = next(iter(self.found.hidden))
        return self.found.inferred(likeliest, self.fit.local, self.bench.bumps)

    @cached_property
    def hidden_pooled(self) -> float:
        """What pooling likelihoods changes in the evidence for something unnamed, as in a refit.

        Of the few that are the likeliest, the one that has most then stands for all.
        """
        found, local = self.found, self.fit.local
        few = list(found.hidden.items())[:FEW]
        each = [found.inferred(hidden, local, self.bench.bumps) for hidden, _ in few]
        more = pooled_by(local, [self.changed_by(one) for one in each])
        return max(log + one for (_, log), one in zip(few, more, strict=True)) - few[0][1]

    def changed_by(self, hidden: Inferred) -> Float[np.ndarray, " n"]:
        """What a cause changes in the readings, to first order, once the fit has given way."""
        return self.fit.local.given_way(hidden.own.columns @ hidden.mean)

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

    def absorption(self) -> Absorption:
        """Fit the model with the likeliest cause of unknown law as a part of it.

        Its signatures come in as they are around the fit it was found at: to first order. Around
        a fit that has left the priors for want of it, they are those of another rig; so where there
        is one that is held near them, what is likeliest there is tried as well.
        """
        self.running.report("fit with what has no name")
        local = self.fit.local
        ends = [self._with(self.found, self.hidden, local.w)]
        if self.near is not None:
            w = let_go(self.near.fit.local, local)
            ends.append(self._with(self.near.found, self.near.hidden, w))
        return max(ends, key=lambda one: one.after.value if one.after.finite else -np.inf)

    def _with(self, found: Explained, hidden: Inferred, w: np.ndarray) -> Absorption:
        """Absorb a cause, from a place `w` (size,) on; `found`: where it was weighed."""
        local = self.fit.local
        sd = found.bundle_of(hidden.hidden).sizes(found.screening.slope)
        hypothesis, about = local.hypothesis, hidden.hidden.about
        # Two of one name may come in, over other things or in other records.
        name = f"{about.name} over {about.over.name} ({len(hypothesis.absorbed) + 1})"
        taken = Absorbed(name, hidden.own.columns * sd)
        more = dataclasses.replace(hypothesis, absorbed=(*hypothesis.absorbed, taken))
        point = Point(more, local.layout, np.append(w, np.zeros(len(sd))), local.z_noise)
        begun = expanded(local.family, point)
        return Absorption(hidden, local, refined(begun) if begun.finite else begun)

    def absorbing(self, one: Absorption) -> "Turn":
        """Return the turn that follows where a cause of unknown law was absorbed."""
        return dataclasses.replace(
            self,
            fit=Fitted(one.after, self.fit.programs),
            bench=self.bench.without(one.hidden.hidden),
            before=self.before + one.log_bayes,
        )

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
    base = refined(facts(base, bench.traces).of(base))
    return jittering(Turn(Fitted(base, programs), bench, running))


def jittering(turn: Turn) -> Turn:
    """Reckon with instants that jitter where this leaves nothing that is missing, and is likelier.

    Nothing is left where records make it no less likely that nothing is missing than it was.
    That something is missing and instants are right has all explanations behind it, but one at a
    time: where two causes are missing, jitter would take up what either leaves of the other.
    """
    local = turn.fit.local
    if (more := asked_for(local)) is None:
        return turn
    lighter = refined(with_weights(local, local.layout.weight / more.variance))
    other = dataclasses.replace(turn, fit=Fitted(lighter, turn.fit.programs))
    right, jittered = (odds(one.found).log[NOTHING] for one in (turn, other))
    enough = jittered > math.log(PRIOR_NOTHING)
    return other if enough and more.log_bayes + JITTER + right - jittered > 0.0 else turn
