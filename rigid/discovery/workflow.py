"""Fit, find what is left over, name it, add it, and again until nothing is missing."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.discovery.refit import MOST, NO_LEAD, Lead, Refit, lead_of, worth_refitting
from rigid.discovery.signatures import Bench
from rigid.discovery.turn import Running, Turn, first_turn
from rigid.discovery.weighing.discrepancy import beside, moderated
from rigid.discovery.weighing.explain import Explained
from rigid.discovery.weighing.odds import Odds, odds
from rigid.discovery.weighing.pairs import UNSURE, Pairs, pairs
from rigid.discovery.weighing.verdict import verdict_of
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import Candidate
from rigid.localfit.families import Effects, Family
from rigid.localfit.leave_one_out import HeldOut, gap, held_out_gap, left_out, units
from rigid.localfit.leave_one_out import Judged as Fit
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import Screening
from rigid.localfit.where import Where, where_shown

LIKELIER = 0.5
"""Something is missing where the probability of nothing is below this, and ..."""
SIGNIFICANT = 0.01
"""... where as much is found in fewer than this share of campaigns in which nothing is."""
LIKELY = 0.02
"""Least probability of an effect that is told as an alternative."""
MOST_STEPS = 3
NEAR = 2
"""Effects that are fitted in full, at most, for what they explain near the priors alone."""
WIDENED = 1e-3
"""Share by which an effect that is named may widen the gap: the gap weighs samples otherwise than
the fit does, and with 424 right names it went up by 6e-4 at most (docs/studies/discovery.md)."""


@dataclasses.dataclass(frozen=True)
class Judged:
    """Without and with an effect: gaps, left-out parts."""

    gap: tuple[float, float]
    held_out_gap: tuple[float, float]
    left: tuple[HeldOut, HeldOut]

    @property
    def gains(self) -> Float[np.ndarray, " parts"]:
        """Log predictive density of each left-out part with the effect, less that without it."""
        return self.left[1].density - self.left[0].density

    @property
    def elpd(self) -> tuple[float, float]:
        """Difference of the log predictive density of left-out parts, and its standard error."""
        difference = self.gains
        spread = float(np.std(difference, ddof=1)) if len(difference) > 1 else 0.0
        return float(difference.sum()), spread * float(np.sqrt(len(difference)))


@dataclasses.dataclass(frozen=True)
class Step:
    """One turn of the workflow.

    - `verdict`: "named", "indistinguishable" or "unnamed". - `explained`: all that was weighed.
    - `said`: the odds of nothing, each effect and something unnamed; with what was left at the end.
    - `refits`: by name. - `chosen`: the effect added, None where none is.
    - `place`, `equation`: where it shows. - `judged`: None where nothing was added.
    - `placebo`: what an effect with another signature explains, as a share of the chosen one;
      median. - `next_record`: what would part the likeliest two, in words.
    - `refused`: why the likeliest effect is not named all the same, by its name; mostly empty.
    """

    verdict: str
    explained: Explained
    said: Odds
    refits: dict[str, Refit]
    chosen: str | None
    place: Where
    equation: str
    judged: Judged | None
    placebo: float
    next_record: str | None = None
    refused: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @property
    def probability(self) -> Mapping[str, float]:
        """Of nothing, each effect and something unnamed."""
        return self.said.probability

    @property
    def tied(self) -> "Tied | None":
        """The likeliest effect and the next, where the records do not part them."""
        if self.verdict != "indistinguishable" or self.chosen is None:
            return None
        chance = self.probability
        rest = [name for name in chance if name in self.explained.effects and name != self.chosen]
        if not rest:
            return None
        return tied(self.explained, self.chosen, max(rest, key=lambda name: chance[name]))


class Tied(NamedTuple):
    """Two effects, each where it explains most, and the amplitude of the first."""

    both: tuple[Candidate, Candidate]
    amplitude: float


def tied(found: Explained, first: str, other: str) -> Tied:
    """Return two effects, each where it explains most, and the amplitude of the first there."""
    mine, its = found.best_of(first), found.best_of(other)
    return Tied((found.listed[mine], found.listed[its]), float(found.screening.estimate[mine]))


@dataclasses.dataclass(frozen=True)
class Outcome:
    """All of it.

    - `base`: the fit of the model as specified. - `programs`: of all candidates. - `steps`.
    - `last`: what was weighed at the end. - `final`: the fit with all that was added.
    """

    base: LocalFit
    programs: tuple[Family, ...]
    bench: Bench
    steps: tuple[Step, ...]
    last: Explained
    last_probability: dict[str, float]
    final: LocalFit

    @property
    def verdict(self) -> str:
        """That of the first step, or that nothing is missing."""
        return self.steps[0].verdict if self.steps else "nothing-missing"

    def before(self, number: int) -> LocalFit:
        """Return the fit around which a step weighed its explanations."""
        for step in reversed(self.steps[:number]):
            if step.chosen is not None:
                return step.refits[step.chosen].after
        return self.base


def discover(
    problem: Problem,
    best: tuple[np.ndarray, np.ndarray],
    effects: Effects,
    given: Mapping[str, AbstractPrior],
    running: Running,
) -> Outcome:
    """Run the workflow.

    - `best`: z and standard gains and zeros where it begins. - `effects`: the candidates.
    - `given`: priors of their parameters, by label, that go before their own.
    """
    return _steps(first_turn(problem, best, effects, given, running))


def _steps(turn: Turn) -> Outcome:
    base, steps = turn.fit.local, []
    said = _odds(turn)
    while len(steps) < MOST_STEPS and _missing(turn.found, said):
        said, refits = _fitted_in_full(turn)
        if not _missing(turn.found, said):
            break
        steps.append(_step(turn, said, refits))
        if steps[-1].chosen is None:
            break
        turn = turn.after(refits[steps[-1].chosen])
        said = _odds(turn)
    left = most_left(turn.found, said) if _missing(turn.found, said) else 0.0
    return Outcome(
        base,
        turn.fit.programs,
        turn.bench,
        in_view_of_the_end(steps, left),
        turn.found,
        dict(said.probability),
        turn.fit.local,
    )


def in_view_of_the_end(steps: Sequence[Step], left: float) -> tuple[Step, ...]:
    """Moderate what was said of each addition by what those after it, and the end, show to be left.

    - `left`: evidence for anything at all at the end, in nats; 0 where nothing is missing there.

    What a later step added counts as left by the earlier ones as far as it may be the discrepancy
    of their laws.
    """
    out: list[Step] = []
    for step in reversed(steps):
        if step.chosen is None:
            out.append(step)
            continue
        said = moderated(step.said, left)
        verdict = step.verdict if said is step.said else verdict_of(step.explained, said)
        # Added it was: what is left takes from how sure the name is, not the addition back.
        verdict = "indistinguishable" if verdict == "unnamed" else verdict
        out.append(dataclasses.replace(step, said=said, verdict=verdict))
        left += max(said.evidence[step.chosen], 0.0) * said.form
    return tuple(reversed(out))


def _odds(
    turn: Turn, changes: Mapping[str, float] | None = None, both: Pairs | None = None
) -> Odds:
    """What the records say at a turn, with what was added before it in view; as `odds`."""
    return beside(odds(turn.found, changes, both), turn.before, turn.found.unnamed)


def most_left(found: Explained, said: Odds) -> float:
    """Evidence for what explains most of what is left, with a name or without, in nats."""
    return max([found.unnamed, *said.evidence.values()])


def _fitted_in_full(turn: Turn) -> tuple[Odds, dict[str, Refit]]:
    """Fit the few best effects in full, and then the likeliest until it is one that was fitted.

    What a signature promises may vanish in the fit: then others come before it.
    """
    found = turn.found
    both, refits = pairs(found), {}

    def fitted() -> dict[str, float]:
        return {name: one.log_bayes for name, one in refits.items()}

    def said() -> Odds:
        return _odds(turn, changed(found, fitted()), both)

    names: list[str] = []
    for name in worth_refitting(said().evidence, found.effects):
        if not _twins(found, names, name):
            names.append(name)
    refits |= turn.refits(names)
    if turn.near is not None:
        alone = turn.near.found.effects
        more = [name for name in worth_refitting(alone, alone) if name in found.effects]
        more = [name for name in more[:NEAR] if not _twins(found, names, name)]
        refits |= turn.refits([n for n in more if n not in refits], _best(refits), turn.near)
    for _ in range(MOST if refits else 0):
        evidence = said().evidence
        first = max(evidence, key=lambda name: evidence[name])
        if evidence[first] <= 0.0:
            break
        if first not in refits:
            refits |= turn.refits([first], _best(refits))
        elif more := unsure_twins(found, fitted(), first):
            refits |= turn.refits(more, _best(refits), twin=refits[first])
        else:
            break
    return said(), refits


def unsure_twins(found: Explained, fitted: Mapping[str, float], name: str) -> list[str]:
    """Twins of an effect to fit in full: those that are less behind than a fit of it has changed.

    - `fitted`: the log Bayes factors of those that were, `name` among them.

    Signatures are of small amplitudes. By how much one twin is ahead of another they say as well as
    they have said what a fit in full brings.
    """
    change = abs(fitted[name] - found.effects[name])
    if change < UNSURE:
        return []
    behind = {n: found.effects[name] - found.effects[n] for n in found.alike(name)}
    twins = [n for n, by in behind.items() if n not in fitted and by < change]
    return sorted(twins, key=lambda n: behind[n])[: MOST - 1]


def _best(refits: Mapping[str, Refit]) -> Lead:
    """The lead of the best fit so far."""
    leads = (lead_of(name, one) for name, one in refits.items())
    return max(leads, key=lambda one: one.height, default=NO_LEAD)


def changed(found: Explained, fitted: Mapping[str, float]) -> dict[str, float]:
    """What fitting in full changed in the log Bayes factor of each effect and of its twins.

    - `fitted`: the log Bayes factors of those that were.
    """
    own = {name: log - found.effects[name] for name, log in fitted.items()}
    twins = {name: _twins(found, fitted, name) for name in found.effects}
    return {name: own[like[0]] for name, like in twins.items() if like} | own


def _twins(found: Explained, fitted: Iterable[str], name: str) -> list[str]:
    """Effects fitted in full whose signature is that of the effect `name`.

    Of such effects only the likeliest is fitted; what that changed holds for the others.
    """
    alike = found.alike(name)
    return [n for n in fitted if n in alike]


def _missing(found: Explained, said: Odds) -> bool:
    return said.nothing < LIKELIER and found.p_value < SIGNIFICANT


def _step(turn: Turn, said: Odds, refits: dict[str, Refit]) -> Step:
    found = turn.found
    verdict, probability = verdict_of(found, said), said.probability
    chosen = max(refits, key=lambda n: probability[n], default=None)
    if verdict == "unnamed" or chosen is None:
        return _unnamed(turn, said, refits)
    one = refits[chosen]
    gain = one.after.terms.value - one.before.terms.value
    change = one.before.residual - one.after.residual
    parts = units(one.before, one.candidate.only)
    left = left_out({"before": Fit(one.before), "after": Fit(one.after)}, parts)
    judged = Judged(
        (gap(one.before), gap(one.after)),
        (held_out_gap(one.before, parts), held_out_gap(one.after, parts)),
        (left["before"], left["after"]),
    )
    if why := refusal(one, judged):
        return dataclasses.replace(_unnamed(turn, said, refits), refused={chosen: why})
    return Step(
        verdict,
        found,
        said,
        refits,
        chosen,
        where_shown(one.after, gain, change),
        one.candidate.effect.equation,
        judged,
        _placebo(found, chosen),
    )


def _unnamed(turn: Turn, said: Odds, refits: dict[str, Refit]) -> Step:
    """A turn at which nothing is added."""
    found, local = turn.found, turn.fit.local
    hidden = found.inferred(local, turn.bench.bumps)
    change = _changed(local, hidden.own.columns @ hidden.mean)
    gain = local.terms.score * change - 0.5 * local.terms.curvature * change**2
    there, equation = where_shown(local, gain, change), hidden.hidden.about.equation
    return Step("unnamed", found, said, refits, None, there, equation, None, 0.0)


def refusal(one: Refit, judged: Judged) -> str:
    """Why an effect is not named however likely it is, in a sentence; empty where it may be.

    A name has to stand on a fit that came to its optimum, narrow the gap and predict what was left
    out of the fit.
    """
    before, after = judged.gap
    difference, error = judged.elpd
    if one.unsettled:
        return f"the fit with it is not settled: {one.unsettled}"
    if after > before * (1.0 + WIDENED):
        return f"the gap grows with it, from {before:.4f} to {after:.4f}"
    if difference < 0.0:
        return (
            "left-out parts of the records are predicted worse with it (log predictive density "
            f"{difference:+.1f}, standard error {error:.1f})"
        )
    return ""


def _changed(local: LocalFit, change: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """What something changes once the fit has given way."""
    gradient = local.design.T @ (local.terms.curvature * change)
    return change - local.design @ np.linalg.solve(local.information, gradient)


def _placebo(found: Explained, chosen: str) -> float:
    """Share of the gain of the chosen effect that one with another signature has, at the median."""
    screening: Screening = found.screening
    best = found.best_of(chosen)
    others = [found.best_of(name) for name in found.effects if name != chosen]
    apart = [i for i in others if abs(screening.cosines[best, i]) < 0.5]
    gains = screening.strength**2
    return float(np.median(gains[apart]) / gains[best]) if apart else 0.0
