"""Fit, find what is left over, name it, add it, and again until nothing is missing."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from rigid.discovery.form import OtherForm
from rigid.discovery.outcome import Judged, Outcome, Step, forms_of
from rigid.discovery.refit import NO_LEAD, Refit, lead_of
from rigid.discovery.rivals import fitted_in_full, turn_odds
from rigid.discovery.turn import Absorption, Running, Turn, first_turn
from rigid.discovery.weighing.discrepancy import borne, in_another_form, moderated
from rigid.discovery.weighing.explain import UNNAMED, Explained
from rigid.discovery.weighing.odds import Odds
from rigid.discovery.weighing.verdict import SURE_NAME, is_missing, verdict_of
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.families import Effects
from rigid.localfit.leave_one_out import Judged as Fit
from rigid.localfit.leave_one_out import gap, held_out_gap, left_out, units
from rigid.localfit.screening import Screening
from rigid.localfit.settled import below, state_of
from rigid.localfit.where import where_shown

LIKELY = 0.02
"""Least probability of an effect that is told as an alternative."""
MOST_STEPS = 3
WIDENED = 1e-3
"""Share by which an effect that is named may widen the gap: the gap weighs samples otherwise than
the fit does, and with 424 right names it went up by 6e-4 at most (docs/studies/discovery.md)."""


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
    base, bench, steps, turns, known = turn.fit.local, turn.bench, [], [], {}
    said = turn_odds(turn)
    while len(steps) < MOST_STEPS and _missing(turn.found, said):
        said, refits = fitted_in_full(turn, known)
        if not _missing(turn.found, said):
            break
        steps.append(_step(turn, said, refits))
        turns.append(turn)
        if steps[-1].came_in is None:
            break
        number, known = ahead_of_an_earlier(turns, steps)
        if known:
            turn = turns[number]
            del steps[number:], turns[number:]
        elif steps[-1].absorbed is not None:
            turn = turn.absorbing(steps[-1].absorbed)
        else:
            turn = turn.after(refits[steps[-1].chosen])
        said = turn_odds(turn)
    doubted = next((i for i, step in enumerate(steps) if step.doubted), None)
    if doubted is not None and not state_of(turn.fit.local, borne(turn.before)).ok:
        turn, step = turns[doubted], steps[doubted]
        why = {step.chosen or "": _not_settled(step.doubted)}
        said, left_over = step.said, _unnamed(turn, step.said, step.refits)
        steps[doubted:] = [dataclasses.replace(left_over, refused=why)]
    left = most_left(said) if _missing(turn.found, said) else 0.0
    forms = forms_of(steps, turn.fit.local)
    return Outcome(
        base,
        turn.fit.programs,
        bench,
        in_view_of_the_end(steps, left, forms),
        turn.found,
        dict(said.probability),
        turn.fit.local,
        forms,
    )


def ahead_of_an_earlier(
    turns: Sequence[Turn], steps: Sequence[Step]
) -> tuple[int, dict[str, Refit]]:
    """Try what was added last in the place of each effect before it.

    Signatures are of small amplitudes: at an early turn an effect may promise little and be passed
    over, or given up, for one that is not needed once both are in. Returns the number of the first
    turn at which the fit with the last effect has more evidence than the one with what was added
    there, and that turn's refits, that one among them; none where there is no such turn.
    """
    name, last = steps[-1].chosen, steps[-1]
    if name is None:
        return 0, {}
    for number, (turn, step) in enumerate(zip(turns[:-1], steps[:-1], strict=True)):
        if step.chosen is None or name not in turn.found.effects:
            continue
        rival, tried = step.refits[step.chosen], step.refits.get(name)
        if tried is not None and not tried.ahead:
            continue
        # One that was given up is not given up again: so it is tried again once.
        lead = lead_of(step.chosen, rival) if tried is None else NO_LEAD
        more = turn.refits([name], lead, twin=last.refits[name])
        if more[name].log_bayes > rival.log_bayes and not more[name].unsettled:
            return number, step.refits | more
    return 0, {}


def in_view_of_the_end(
    steps: Sequence[Step], left: float, forms: Mapping[str, OtherForm]
) -> tuple[Step, ...]:
    """Moderate what was said of each addition by what those after it, and the end, show to be left.

    - `left`: evidence for anything at all at the end, in nats; 0 where nothing is missing there.
    - `forms`: in which the records want what was added, by name.

    What a later step added counts as left by the earlier ones as far as it may be the discrepancy
    of their laws; what it absorbed, all of it.
    """
    out: list[Step] = []
    for step in reversed(steps):
        if step.chosen is None:
            out.append(step)
            left += 0.0 if step.absorbed is None else most_left(step.said)
            continue
        said = moderated(step.said, left)
        if step.chosen in forms:
            said = in_another_form(said, step.chosen, forms[step.chosen].log_bayes)
        verdict = step.verdict if said is step.said else verdict_of(step.explained, said)
        # Added it was: what is left takes from how sure the name is, not the addition back.
        verdict = "indistinguishable" if verdict == "unnamed" else verdict
        out.append(dataclasses.replace(step, said=said, verdict=verdict))
        left += max(said.evidence[step.chosen], 0.0) * said.form
    return tuple(reversed(out))


def most_left(said: Odds) -> float:
    """Evidence for what explains most of what is left, with a name or without, in nats."""
    return max([said.unnamed, *said.evidence.values()])


def _missing(found: Explained, said: Odds) -> bool:
    return is_missing(said.nothing, found.p_value)


def _step(turn: Turn, said: Odds, refits: dict[str, Refit]) -> Step:
    found = turn.found
    verdict, probability = verdict_of(found, said), said.probability
    chosen = max(refits, key=lambda n: probability[n], default=None)
    if verdict == "unnamed" or chosen is None:
        return _absorbing(turn, said, refits)
    one = refits[chosen]
    gain = one.after.terms.value - one.before.terms.value
    change = one.before.residual - one.after.residual
    judged = _judged(one, one.candidate.only)
    doubted = one.unsettled if mendable(one) else ""
    if why := refusal(one, judged, believed=bool(doubted)):
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
        doubted=doubted,
    )


def _judged(one: Refit | Absorption, only: str | None = None) -> Judged:
    """Gaps and left-out parts without and with what came in.

    - `only`: the record that it is confined to.
    """
    parts = units(one.before, only)
    left = left_out({"before": Fit(one.before), "after": Fit(one.after)}, parts)
    return Judged(
        (gap(one.before), gap(one.after)),
        (held_out_gap(one.before, parts), held_out_gap(one.after, parts)),
        (left["before"], left["after"]),
    )


def _unnamed(turn: Turn, said: Odds, refits: dict[str, Refit]) -> Step:
    """A turn at which no effect is added."""
    local, hidden = turn.fit.local, turn.hidden
    change = turn.changed_by(hidden)
    gain = local.gain_of(change)
    there, equation = where_shown(local, gain, change), hidden.hidden.about.equation
    return Step(
        "unnamed", turn.found, said, refits, None, there, equation, None, 0.0, hidden=hidden
    )


def _absorbing(turn: Turn, said: Odds, refits: dict[str, Refit]) -> Step:
    """A turn at which what has no name comes in as such, if it may as a named effect might.

    It has to be as sure to have none as a name has to be sure: what may be an effect, or what the
    law of the last one leaves, would be taken away from it.
    """
    step = _unnamed(turn, said, refits)
    if said.probability[UNNAMED] - said.form < SURE_NAME:
        return step
    one = turn.absorption()
    judged = _judged(one)
    if refusal(one, judged):
        return step
    return dataclasses.replace(step, hidden=one.hidden, judged=judged, absorbed=one)


def mendable(one: Refit) -> bool:
    """Whether a fit came to an optimum that is where no rig is, with all else in order.

    Something else that is missing may drive numbers there: whether the name may stand is seen once
    that is in the model as well.
    """
    state = state_of(one.after, borne(one.log_bayes + one.earlier))
    drifted = bool(state.far) and state.flat and not one.another
    return drifted and not below(one.after, one.before)


def _not_settled(why: str) -> str:
    return f"the fit with it is not settled: {why}"


def refusal(one: Refit | Absorption, judged: Judged, believed: bool = False) -> str:
    """Why nothing comes in however likely it is, in a sentence; empty where it may.

    - `believed`: for now, wherever the fit ended.

    It has to stand on a fit that came to its optimum, narrow the gap and predict what was left
    out of the fit.
    """
    before, after = judged.gap
    difference, error = judged.elpd
    if one.unsettled and not believed:
        return _not_settled(one.unsettled)
    if after > before * (1.0 + WIDENED):
        return f"the gap grows with it, from {before:.4f} to {after:.4f}"
    if difference < 0.0:
        return (
            "left-out parts of the records are predicted worse with it (log predictive density "
            f"{difference:+.1f}, standard error {error:.1f})"
        )
    return ""


def _placebo(found: Explained, chosen: str) -> float:
    """Share of the gain of the chosen effect that one with another signature has, at the median."""
    screening: Screening = found.screening
    best = found.best_of(chosen)
    others = [found.best_of(name) for name in found.effects if name != chosen]
    apart = [i for i in others if abs(screening.cosines[best, i]) < 0.5]
    gains = screening.strength**2
    return float(np.median(gains[apart]) / gains[best]) if apart else 0.0
