"""From a verdict to what its section of the page shows, and to the table of the terminal."""

from collections.abc import Sequence

import numpy as np

from rigid.report.content import BAD, GOOD, RESERVE, Answer, Check, Front, Provenance
from rigid.report.validation.section import RankShown, ValidationContent
from rigid.spec import Spec
from rigid.validation.agreement import Agreement
from rigid.validation.coverage import LEVELS, Coverage
from rigid.validation.design import FAST, FULL, SLOPES, Design
from rigid.validation.ecdf import band, counts, points
from rigid.validation.misfit import Effect, first_for_each
from rigid.validation.tested import JOINT, Tested
from rigid.validation.verdict import ENOUGH, Verdict

BAND = 0.95
"""Level of the band that is drawn; verdicts rest on probabilities corrected for all tests."""
FITTED = {FAST: "fast", FULL: "as the command fits"}
MOST_ROWS = 12
"""Quantities in the table of the terminal where none fails."""


def content(
    spec: Spec,
    found: Verdict,
    beside: Agreement | None,
    misfits: Sequence[Effect],
    provenance: Provenance,
) -> ValidationContent:
    """Gather the section."""
    n = found.replicates
    least, greatest = band(n, BAND) if n > 1 else (np.zeros(0), np.zeros(0))
    at = points(n) if n > 1 else np.zeros(0)
    return ValidationContent(
        title=spec.title or spec.path.stem,
        simulated=True,
        front=front(found, misfits),
        provenance=provenance,
        checks=tuple(Check(c.name, c.ok, c.says) for c in found.checks),
        tested=tuple(found.tested),
        heads=tuple(
            f"{level:.0%} interval holds (95 % band)".replace("%", " %", 1) for level in LEVELS
        ),
        notes=notes(found, beside),
        misfits=tuple(first_for_each(misfits)),
        by=found.design.shift,
        alarms=found.alarms,
        shown=tuple(
            RankShown(
                one.name,
                one.name in JOINT,
                one.ok,
                points(len(one.ranks)),
                counts(one.ranks) / len(one.ranks) - points(len(one.ranks)),
            )
            for one in found.tested
        ),
        least=least / max(n, 1) - at,
        greatest=greatest / max(n, 1) - at,
    )


def front(found: Verdict, misfits: Sequence[Effect]) -> Front:
    """Question, verdict, answers, what to do."""
    reserved = found.design.shift or _too_few(found)
    state = RESERVE if reserved else GOOD if found.usable else BAD
    return Front(
        asked="Do the posteriors of this spec hold the truth as often as they say?",
        state=state,
        ruling=ruling(found, misfits),
        why=tuple(c.says for c in found.checks if not c.ok) if state == BAD else (),
        answers=_answers(found),
        cannot=(
            "Whether the model itself is right: campaigns are drawn from it. A prior that does not "
            "fit is tried with `--misfit`, a missing effect with `rigid discover`.",
        ),
        next=_next(found),
        figure="ranks",
    )


def _answers(found: Verdict) -> tuple[Answer, ...]:
    """All quantities together, then those that fail."""
    lines = []
    if found.held:
        every = found.held[0]
        own = (
            f"of truths in {every.level:.0%} intervals of all quantities; "
            f"{100 * (every.level + every.apart):.1f} ± {100 * every.apart_error:.1f} % with the "
            "chance of these campaigns taken off"
        ).replace("%", " %", 1)
        share = f"{100 * every.share:.1f} ± {100 * every.error:.1f} %"
        lines.append(Answer("all quantities", share, own))
    lines += [
        Answer(one.name, _share(one.coverage[-1]), f"of truths in 90 % intervals: {one.says}")
        for one in found.faults[:3]
    ]
    return tuple(lines)


def ruling(found: Verdict, misfits: Sequence[Effect] = ()) -> str:
    """The verdict in a sentence."""
    design = found.design
    if design.shift and misfits:
        worst = first_for_each(misfits)
        if worst:
            one = worst[0]
            return (
                f"With a constant {design.shift:g} prior sds off, {one.parameter} breaks first: "
                f"{one.constant} takes its 90 % interval to {_share(one.coverage)}."
            )
    told = f"after {found.replicates} replicates"
    broken = f", the likelihood broken on purpose ({design.broken})" if design.broken else ""
    if found.usable:
        return f"Sound {told}{broken}: {_as_they_should(design)}."
    first = next(c for c in found.checks if not c.ok)
    if _too_few(found):
        return f"Too early to say{broken}: nothing fails yet, but {first.says}."
    return f"Not sound {told}{broken}: {first.says}."


def _too_few(found: Verdict) -> bool:
    """Whether nothing is wrong but the number of replicates."""
    return not found.failed and [c.name for c in found.checks if not c.ok] == [ENOUGH]


def _as_they_should(design: Design) -> str:
    if design.fit == SLOPES:
        return "the likelihood's slopes at the truths are as long as it says"
    return "ranks, coverage and the joint posterior are as they should be"


def _next(found: Verdict) -> tuple[str, ...]:
    """What to do now."""
    if found.design.broken:
        return ()
    if found.design.shift:
        return ("Widen the prior of a constant that may be so far off, and fit again.",)
    if found.design.fit == SLOPES and found.usable:
        return ("Validate the fits too: the same command without `--slopes`.",)
    if found.usable:
        finer = "For finer faults: more `--replicates`, with `--resume`."
        return (f"Quote the intervals of this spec. {finer}",)
    if _too_few(found):
        return ("Run with `--replicates 100 --resume`: the replicates that are done are kept.",)
    lines = ["Widen what the spec knows too well (priors, noise, gains), or report a defect."]
    if found.design.fit == FAST:
        lines.insert(0, "Run with `--full` first: it shows whether the fast mode is what fails.")
    return tuple(lines)


def notes(found: Verdict, beside: Agreement | None) -> tuple[str, ...]:
    """Sentences on how to read the section."""
    design = found.design
    if design.fit == SLOPES:
        return (
            "No campaign was fitted. Over campaigns drawn from priors and likelihood the slope of "
            "the log-posterior at the truth has mean zero and the information there as covariance; "
            "`score` is the probability of a shorter one, uniform where the likelihood is right. "
            "It says nothing of search and draws: leave `--slopes` out for these.",
        )
    where = "around the posterior that was given" if design.around else "from the priors"
    lines = [
        f"Campaigns are drawn {where} through the records' own sampling, valve programmes, sensors "
        f"and converters, and fitted {FITTED[design.fit]}. "
        f"{found.refused} further draws would have been refused as records of this rig.",
        "Under a sound posterior the probability below the truth is uniform from campaign to "
        "campaign. A quantity fails where one of its three tests does at a level of 1 % for all "
        "tests together (Holm).",
        "Two ranks tell where a fault lies. `score` is that of the likelihood's slope at the "
        "truth, before any fit: high where the likelihood itself is too sure. `weight` is that of "
        "what a truth weighs against the law that draws are made of: high where draws miss the "
        "places of truths. The slope also foretells how far off each estimate must be; what "
        "intervals hold less than so foretold is the fit's own doing, the rest is the chance of "
        "these campaigns.",
    ]
    if design.fit == FAST:
        lines.append(
            "The fast mode sums weighted draws of the law around the best fits near the truth and "
            "from a prior start, or, where their weights do not do, draws at conditional modes, or "
            "a short chain: it does not show how often the search of a fit misses a mode."
        )
    lines.append(
        f"Fast beside full: {beside.says}."
        if beside is not None
        else "Fast beside full: no campaign was fitted both ways; `--full --replicates 5` in the "
        "same folder shows the fast mode's error."
    )
    return tuple(lines)


def _share(one: Coverage) -> str:
    return f"{100 * one.share:.0f} %"


def _banded(one: Coverage) -> str:
    return f"{_share(one)} ({100 * one.low:.0f} to {100 * one.high:.0f})"


def table(found: Verdict, beside: Agreement | None, misfits: Sequence[Effect]) -> str:
    """The result as a table for the terminal."""
    lines = [f"verdict: {ruling(found, misfits)}"]
    if misfits:
        lines.append(
            f"{'constant':24}{'hurts most':28}{'90 % holds':>18}{'error':>8}{'expected':>10}"
        )
        for one in first_for_each(misfits):
            lines.append(
                f"{one.constant:24}{one.parameter:28}{_banded(one.coverage):>18}"
                f"{one.error:8.2f}{one.expected:10.2f}"
            )
    else:
        lines.append(f"{'quantity':28}{'p':>9}{'50 % holds':>18}{'90 % holds':>18}{'narrower':>10}")
        joint = [one for one in found.tested if one.name in JOINT]
        shown = list(found.faults) or [*found.tested[: MOST_ROWS - len(joint)], *joint]
        lines += [_line(one) for one in dict.fromkeys(shown)]
        if len(shown) < len(found.tested):
            lines.append(f"({len(found.tested) - len(shown)} more quantities in the report)")
    lines += [
        one.says for one in (found.slopes, *found.held[:1], beside, found.alarms) if one is not None
    ]
    return "\n".join(lines) + "\n"


def _line(one: Tested) -> str:
    shares = "".join(f"{_banded(c):>18}" for c in one.coverage)
    gained = "" if one.gained is None else f"{100 * one.gained:.0f} %"
    return f"{one.name:28}{one.p:9.2g}{shares}{gained:>10}{'' if one.ok else '  FAILS'}"
