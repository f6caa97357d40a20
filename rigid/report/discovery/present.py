"""From the outcome of discovery to what its section of the page shows."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from rigid.discovery.outcome import Judged, Outcome, Step
from rigid.discovery.weighing.explain import (
    NOTHING,
    PRIOR_NOTHING,
    PRIOR_UNNAMED,
    UNNAMED,
    Explained,
)
from rigid.discovery.weighing.odds import MIMICS
from rigid.localfit.leave_one_out import gap
from rigid.plots.shown import HiddenShown
from rigid.report.content import BAD, GOOD, RESERVE, Answer, Check, Front, Provenance
from rigid.report.discovery.compared import Compared, sentence, shown, table
from rigid.report.discovery.held_out import turned_out
from rigid.report.discovery.lead import (
    NEXT,
    SHOWN,
    chance,
    form,
    lead,
    moves,
    other_laws,
    refused,
    ruling,
    share,
    would_show,
)
from rigid.report.discovery.output import alternatives
from rigid.report.discovery.residuals import against, residuals
from rigid.report.discovery.section import DiscoveryContent, StepContent
from rigid.report.discovery.words import introduced, meanings
from rigid.report.taken import sentences
from rigid.spec import Spec
from rigid.spec.values import BODY, ModelSpec

TOLD_ODDS = 8
LEAST_APART = 0.8


class Context(NamedTuple):
    """What goes with a run of the model against records.

    - `provenance`. - `notes`: what was dropped on reading. - `compared`: where it disagrees with
      them. - `checks`: what must hold for the result to be used.
    """

    provenance: Provenance
    notes: tuple[str, ...]
    compared: Compared
    checks: tuple[Check, ...] = ()


def content(spec: Spec, outcome: Outcome, made: dict[str, Any], run: Context) -> DiscoveryContent:
    """Gather the section; `made` is what goes to discovery.json."""
    first = outcome.steps[0].explained if outcome.steps else outcome.last
    names, cosines = told_apart(first)
    from_on = would_show(first)
    return DiscoveryContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        taken=sentences(made),
        front=front(outcome, made, run),
        provenance=run.provenance,
        checks=run.checks,
        steps=tuple(
            _step(number, step, told, spec.model)
            for number, (step, told) in enumerate(
                zip(outcome.steps, made["steps"], strict=True), start=1
            )
        ),
        where=(sentence(run.compared), table(made["disagreements"])),
        compared=shown(run.compared),
        bets=bets(),
        ending=_ending(outcome),
        notes=run.notes,
        names=names,
        cosines=cosines,
        pairs=_pairs(names, cosines),
        noise=tuple(made["noise"]),
        rejected=tuple(
            (one["effect"], one["why"], from_on[one["effect"]]) for one in made["rejected"]
        ),
        shown=SHOWN,
    )


def front(outcome: Outcome, made: dict[str, Any], run: Context) -> Front:
    """Question, verdict, answers, what disagrees with the verdict, what to do."""
    failed = [one for one in run.checks if not one.ok]
    spec = next((one["spec"] for one in made["steps"] if one["spec"]), None)
    told = dict(lead(outcome, spec))
    settled = outcome.verdict in ("nothing-missing", "named")
    return Front(
        asked="Is an effect missing from the model of these records, and which?",
        state=BAD if failed else GOOD if settled else RESERVE,
        ruling=ruling(outcome),
        why=(*(f"{one.name}: {one.says}" for one in failed), sentence(run.compared)),
        answers=tuple(
            Answer(question, " ".join(paragraphs))
            for question, paragraphs in told.items()
            if question != NEXT
        ),
        cannot=cannot(outcome),
        next=told.get(NEXT, ()),
        figure="against-1" if outcome.steps and outcome.steps[0].chosen else "where",
    )


def cannot(outcome: Outcome) -> tuple[str, ...]:
    """What the records cannot say."""
    weak = (
        "Effects too weak for these records: the table under 'What was tried and not kept' says "
        "from what size on each would have shown."
    )
    either = [
        f"Whether it is {' or '.join([step.chosen, *(a['effect'] for a in alternatives(step))])}."
        for step in outcome.steps
        if step.chosen and alternatives(step)
    ]
    return (*either, weak)


def told_apart(found: Explained) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the effects and the cosines of the traces of the best candidate of each."""
    names = tuple(
        name for name in found.effects if found.screening.size[found.best_of(name)] > 1e-90
    )
    at = np.array([found.best_of(name) for name in names], dtype=int)
    return names, found.screening.cosines[np.ix_(at, at)]


def _pairs(names: tuple[str, ...], cosines: np.ndarray) -> tuple[str, ...]:
    out = []
    for i in range(len(names)):
        for j in range(i):
            if abs(cosines[i, j]) > LEAST_APART:
                out.append(
                    f"{names[j]} and {names[i]}: cosine {cosines[i, j]:.2f}; a strength of "
                    f"{_needed(abs(cosines[i, j])):.0f} is needed to tell them apart in 19 of 20."
                )
    return tuple(out)


def _needed(cosine: float) -> float:
    """Strength s at which s sqrt((1 - c)/2) is 1.64."""
    return 1.64 / float(np.sqrt(max(0.5 * (1.0 - cosine), 1e-6)))


def _step(number: int, step: Step, told: dict[str, Any], model: ModelSpec) -> StepContent:
    nameless = (
        "an effect that fails a check" if step.refused else "something that no effect explains"
    )
    name = step.chosen or nameless
    worded = introduced(step.explained, name)
    sentences = [
        *([f"{worded}."] if worded != name else []),
        *([refused(step)] if step.refused else []),
        *other_laws(step),
        _shows(told["where"]),
        f"{chance(step)} All that was tried is counted.",
        *filter(None, [form(step)]),
    ]
    if step.judged is not None:
        sentences.append(_left_out(step.judged))
    if step.chosen is not None:
        sentences.append(
            f"A placebo, an effect with another trace, explains {100 * step.placebo:.0f} % as much."
        )
    hidden = None if step.hidden is None else _of_the_body(step.hidden.shown, model)
    if hidden is not None:
        shape = f": {hidden.words}"
        if not hidden.groups:
            fits = f"in SI units{shape}" if hidden.words else "no simple formula fits its shape"
            shape = f" over {hidden.variable}, {fits}"
        sentences.append(f"What explains most: {hidden.name}{shape}.")
    if step.absorbed is not None:
        sentences.append(
            "It came into the model as it is shown here, to first order and without a law; what "
            "follows was sought beside it."
        )
    if step.next_record:
        sentences.append(f"The record that would tell most: {step.next_record}.")
    means = {} if step.chosen is None else meanings(step.refits[step.chosen].after.hypothesis)
    return StepContent(
        heading=f"Step {number}: {name}",
        sentences=tuple(sentences),
        odds=_odds(step),
        turned=turned_out(step.probability[name]) if number == 1 and step.chosen else None,
        parameters=tuple(
            (k, means[k], v["unit"], v["q05"], v["median"], v["q95"])
            for k, v in told["parameters"].items()
        ),
        moved=() if step.came_in is None else moves(step.came_in),
        gaps=_gaps(told["gap"]),
        against=against(step),
        residuals=residuals(step),
        hidden=hidden,
    )


def _of_the_body(shown: HiddenShown, model: ModelSpec) -> HiddenShown:
    """Call plunger and stroke what they are where another machine was measured."""
    if model.body == BODY:
        return shown
    return dataclasses.replace(
        shown,
        name=shown.name.replace(BODY, model.body),
        variable=shown.variable.replace("stroke", "position"),
    )


def _shows(where: dict[str, Any]) -> str:
    """Where it shows most, and in which equation."""
    time, lines = where["time_s"], where["frequency_Hz"]
    return (
        f"It shows most in record {where['record']},{where['cylinder']}, channel "
        f"{where['channel']}"
        + (f", from {time[0]:.2f} to {time[1]:.2f} s" if time else "")
        + (f", a line of {lines[0]:.4g} to {lines[1]:.4g} Hz" if lines else "")
        + f". Equation: {where['equation']}."
    )


def _left_out(judged: Judged) -> str:
    """What parts of the records say of it that were left out of the fit and predicted."""
    gains = judged.gains
    difference, error = judged.elpd
    return (
        f"Left out of the fit in turn, {int(np.sum(gains > 0.0))} of {len(gains)} parts of the "
        f"records are predicted better with it (log predictive density {difference:+.1f} in all, "
        f"standard error {error:.1f})."
    )


def _odds(step: Step) -> tuple[tuple[str, float, float, str], ...]:
    logs = {NOTHING: 0.0, UNNAMED: step.explained.unnamed} | step.explained.effects
    logs |= {name: one.log_bayes for name, one in step.refits.items()}
    ranked = sorted(step.probability, key=lambda k: -step.probability[k])[:TOLD_ODDS]
    words = {NOTHING: "nothing is missing", UNNAMED: "something else"}
    return tuple(
        (
            words.get(name, name),
            step.probability[name],
            logs[name],
            "" if name == NOTHING else _told_by(step, name),
        )
        for name in ranked
    )


def _told_by(step: Step, name: str) -> str:
    if name not in step.refits:
        return "screening"
    one = step.refits[name]
    if one.another:
        return f"full fit, as another law: {one.another}"
    return f"fit given up, far below {one.ahead}" if one.ahead else "full fit"


def _gaps(told: dict[str, float] | None) -> tuple[tuple[str, str, str], ...]:
    if told is None:
        return ()
    return (
        ("fitted records", f"{told['before']:.4f}", f"{told['after']:.4f}"),
        ("left-out parts", f"{told['held_out_before']:.4f}", f"{told['held_out_after']:.4f}"),
    )


def bets() -> str:
    """What one would bet before any record, and that what looks like an effect may be none."""
    effects = 1.0 - PRIOR_NOTHING - PRIOR_UNNAMED
    like = 1.0 + effects / (MIMICS * PRIOR_UNNAMED)
    return (
        f'Before, one bets {PRIOR_NOTHING:.2f} on "nothing is missing", {effects:.2f} on all '
        f"effects together and {PRIOR_UNNAMED:.2f} on something else. Of all that looks like an "
        f"effect, one in {like:.0f} is taken to be something else that no record can tell from it."
    )


def _ending(outcome: Outcome) -> tuple[str, ...]:
    last = outcome.last
    left = (
        f"With what was added, the gap is {gap(outcome.final):.4f} (1 is the floor); as much as is "
        f"left over is found in {share(last.p_value)} of campaigns in which nothing is missing."
    )
    if not outcome.steps:
        left = f"The gap is {gap(outcome.final):.4f} (1 is the floor); nothing was added."
    return (left,)
