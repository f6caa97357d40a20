"""The answer in a few plain sentences, for a reader who knows rigs and not statistics."""

from collections.abc import Iterator

import numpy as np

from rigid.discovery.form import CLEARLY
from rigid.discovery.outcome import Outcome, Step
from rigid.discovery.refit import Refit
from rigid.discovery.turn import Absorption
from rigid.discovery.weighing.explain import NOTHING, UNNAMED, Explained
from rigid.discovery.weighing.verdict import LIKELIER
from rigid.discovery.workflow import LIKELY
from rigid.localfit.leave_one_out import gap
from rigid.plots import metrology
from rigid.plots.metrology import digits, median_and_interval
from rigid.report.discovery.output import added_labels, alternatives, quoted
from rigid.report.discovery.section import Moved
from rigid.report.discovery.words import called, introduced, meanings

NEXT = "What next?"
TOLD_MOVES = 3
SHOWN = 5.0
"""Strength at which an effect is told to have shown."""


def ruling(outcome: Outcome) -> str:
    """The verdict in a sentence."""
    if not outcome.steps:
        if outcome.last_probability[NOTHING] < LIKELIER:
            return "These records do not decide whether something is missing."
        return "Nothing is missing that these records show."
    first = outcome.steps[0]
    if first.verdict == "named":
        named = [step.chosen or "" for step in outcome.steps if step.verdict == "named"]
        return f"Missing: {' and '.join(named)}."
    if first.verdict == "indistinguishable":
        either = [first.chosen or "", *(one["effect"] for one in alternatives(first))]
        if len(either) == 1:
            return f"Probably missing: {either[0]}; it may be something else that looks like it."
        return f"Something is missing; these records cannot tell which: {', '.join(either)}."
    if first.refused:
        return "Something is missing; the effect that explains most of it fails a check."
    more = "".join(
        f" Beside it {step.chosen} is {'' if step.verdict == 'named' else 'probably '}missing."
        for step in outcome.steps
        if step.chosen is not None
    )
    return f"Something is missing, and no effect of the catalogue explains it.{more}"


def lead(outcome: Outcome, extended: str | None) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Questions that a reader has, and the answers, in order; a paragraph for each step.

    - `extended`: the path of the spec with what was added, None where nothing was.
    """
    if not outcome.steps:
        nothing = outcome.last_probability[NOTHING]
        sure = (
            f"Of campaigns in which the model is complete, {share(outcome.last.p_value)} leave as "
            "much over as these records do. The probability that nothing is missing is "
            f"{chance_of(nothing)}. What is too weak for these records may be missing all the "
            "same: the table under 'What was tried and not kept' says from what size on an effect "
            "would have shown."
        )
        still = f"Nothing was added. The gap is {gap(outcome.base):.4f}."
        return (("How sure?", (sure,)), ("What changed?", (still,)))
    unknown = (
        "Nothing was added. Until what is missing is known, the quoted numbers stand for whatever "
        "the model makes of it."
    )
    came_in = extended is not None or any(step.absorbed for step in outcome.steps)
    changed = tuple(map(_changed, outcome.steps)) if came_in else (unknown,)
    driven = outcome.settled.warning
    return (
        ("What is it?", tuple(map(_what, outcome.steps))),
        ("How sure?", (*([f"{driven}."] if driven else ()), *_all_sure(outcome))),
        ("What changed?", changed),
        (NEXT, (_next(outcome.steps, extended),)),
    )


def chance_of(probability: float) -> str:
    """A probability as the sentences say it: to two places, never 0 or 1."""
    return metrology.chance(probability, 2)


def share(p_value: float) -> str:
    """How often, as a reader would say it."""
    return "fewer than 1 in 1,000" if p_value < 1e-3 else f"{100 * p_value:.1f} %"


def chance(step: Step) -> str:
    """How often as much is found where nothing is missing."""
    return (
        f"Chance alone finds as much in {share(step.explained.p_value)} of campaigns in which "
        "nothing is missing."
    )


def _what(step: Step) -> str:
    if step.chosen is None:
        shows = (
            f"It shows most in record {step.place.record},{step.place.cylinder}, "
            f"channel {step.place.channel}."
        )
        if step.refused:
            return f"{refused(step)} {shows}"
        behind = " It came into the model without a law." if step.absorbed else ""
        return f"Something that none of the effects tried leaves. {shows}{behind}"
    names = [step.chosen, *(one["effect"] for one in alternatives(step))]
    return "; or ".join(introduced(step.explained, name) for name in names) + "."


def refused(step: Step) -> str:
    """Why an effect that explains most is not named."""
    return " ".join(
        f"{name} explains most (probability {chance_of(step.probability[name])}) but is not "
        f"named: {why}."
        for name, why in step.refused.items()
    )


def other_laws(step: Step) -> tuple[str, ...]:
    """Of effects that explain more than what came in, but with numbers of another law: which."""
    least = step.said.unnamed
    if step.chosen is not None:
        least = step.refits[step.chosen].log_bayes
    return tuple(
        f"{name} explains more, but as another law only, and is not counted: {one.another}."
        for name, one in step.refits.items()
        if one.another and one.log_bayes > least
    )


def form(step: Step) -> str:
    """That what is left may be how far the law of what was added is off; empty where it is not."""
    if step.said.form < LIKELY:
        return ""
    return (
        f"With a probability of {chance_of(step.said.form)} it is no second effect but what the "
        "law of the effect added before leaves: no law is exact, and this is little beside what "
        "that one explains."
    )


def _all_sure(outcome: Outcome) -> Iterator[str]:
    """How sure each step is, and whether its effect is wanted in another form."""
    for step in outcome.steps:
        yield " ".join(filter(None, (_sure(step), formed(outcome, step))))


def formed(outcome: Outcome, step: Step) -> str:
    """That the records want an effect in another form than its law has; empty where they do not."""
    one = outcome.forms.get(step.chosen or "")
    if one is None or one.log_bayes < CLEARLY:
        return ""
    return (
        f"Its law has not the form that acts: let vary over {one.over} by half and more, "
        f"{step.chosen} explains the records {one.log_bayes:.0f} nats better. It may be another "
        "cause that looks like it."
    )


def _sure(step: Step) -> str:
    if step.refused:
        return chance(step)
    if step.chosen is None:
        unnamed = step.probability[UNNAMED]
        none = f"The probability that it has no name is {chance_of(unnamed)}."
        return " ".join(filter(None, (chance(step), none, form(step), _better(step))))
    rest = "".join(
        f", {one['effect']} {chance_of(one['probability'])}" for one in alternatives(step)
    )
    names = f"Probability: {step.chosen} {chance_of(step.probability[step.chosen])}{rest}."
    names = " ".join(filter(None, (names, form(step))))
    return " ".join(filter(None, (chance(step), names, _better(step))))


def _better(step: Step) -> str:
    """How many left-out parts are predicted better; empty where nothing came in."""
    if step.judged is None:
        return ""
    gains = step.judged.gains
    better = f"{int(np.sum(gains > 0.0))} of {len(gains)} left-out parts"
    return f"{better} are predicted better with it."


def _changed(step: Step) -> str:
    """What one addition brought in and moved."""
    one = step.came_in
    if one is None or step.judged is None:
        return "Something is left over that has no name."
    before, after = step.judged.gap
    ends = f"{told_moves(moves(one))} Gap {before:.4f} before, {after:.4f} after."
    if not isinstance(one, Refit) or step.chosen is None:
        return f"What has no name came in as it is. {ends}"
    values = {
        label: one.after.interval(label)
        for label in added_labels(one.after.hypothesis, step.chosen)
    }
    means = meanings(one.after.hypothesis)
    brought = ", ".join(
        f"{called(label, means[label])} = "
        f"{median_and_interval((v['q05'], v['median'], v['q95']), v['unit'])}"
        for label, v in values.items()
    )
    return f"{step.chosen} came in: {brought}. {ends}"


def told_moves(moved: tuple[Moved, ...]) -> str:
    """The numbers that moved farthest, one of each sort: kappa of one record, not of all."""
    far = sorted((m for m in moved if abs(m.sds) >= 1.0), key=lambda m: -abs(m.sds))
    if not far:
        return "No quoted number moved by as much as its uncertainty."
    sorts = {m.name: m for m in reversed(far)}
    first = sorted(sorts.values(), key=lambda m: -abs(m.sds))[:TOLD_MOVES]
    told = ", ".join(
        f"{called(m.label, m.means)} from {digits(m.before, m.unit, 4)} to "
        f"{digits(m.after, m.unit, 4)}"
        for m in first
    )
    more = f", and {len(far) - len(first)} more" if len(far) > len(first) else ""
    return f"Moved by more than its uncertainty: {told}{more}."


def moves(one: Refit | Absorption) -> tuple[Moved, ...]:
    """How the quoted numbers moved when something came in."""
    out, means = [], meanings(one.before.hypothesis)
    names = {p.label: p.base for p in one.before.hypothesis.parameters}
    for label in quoted(one.before.hypothesis):
        before, after = one.before.interval(label), one.after.interval(label)
        at = [fit.hypothesis.labels.index(label) for fit in (one.before, one.after)]
        sd = float(np.sqrt(one.after.covariance[at[1], at[1]]))
        size = abs(float(one.after.w[at[1]] - one.before.w[at[0]])) / sd
        sds = float(np.copysign(size, after["median"] - before["median"]))
        told = before["unit"], before["median"], after["median"], sds
        out.append(Moved(label, names[label], means[label], *told))
    return tuple(out)


def _next(steps: tuple[Step, ...], extended: str | None) -> str:
    parts = [f"To know which, take {s.next_record}." for s in steps if s.next_record is not None]
    if parts and steps[-1].chosen is None and len(steps) > 1:
        parts.append("That is reckoned with exact laws; what is left says that one is not.")
    if extended is not None:
        parts.append(
            f"`python -m rigid.fit {extended}` samples the model with what was added and gives its "
            "intervals."
        )
        if any(step.absorbed for step in steps):
            parts.append("What has no name is not in that model: its numbers stand in for it.")
    else:
        parts.append(
            "The figure below shows what would have to be added; docs/own-effects.md says how to "
            "write it as an effect of your own."
        )
    return " ".join(parts)


def would_show(found: Explained) -> dict[str, str]:
    """By effect: how far its number lies from absence at a strength of SHOWN, "F_C 12.3 N".

    Where an effect has several shapes or places, at that of median size.
    """
    out = {}
    for name in found.effects:
        at = [
            i
            for i, one in enumerate(found.listed)
            if one.effect.name == name and found.screening.size[i] > 1e-90
        ]
        if not at:
            out[name] = "nothing shows"
            continue
        size = [SHOWN / found.screening.size[i] * abs(found.listed[i].level or 1.0) for i in at]
        one = found.listed[at[0]]
        info = next(i for i in one.effect.parameters() if one.amplitude in i.labels)
        out[name] = f"{one.amplitude} {digits(float(np.median(size)), info.unit)}"
    return out
