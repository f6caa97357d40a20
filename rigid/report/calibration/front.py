"""The first screen of the section on a calibration."""

import itertools
from collections.abc import Sequence

import numpy as np

from rigid.inference.alternatives import Alternative
from rigid.inference.calibrate import Calibrated
from rigid.plots import metrology
from rigid.plots.shown import FrictionCurve
from rigid.report import wording
from rigid.report.calibration.budget import silent
from rigid.report.content import BAD, GOOD, Answer, Check, Front, KeyNumber

MOST_ANSWERS = 7
NEXT = {
    "residuals": "Run `rigid discover` on this spec: it says where records and model disagree and "
    "which effect is missing. The worst record is named in the check; leave it out (`fit = false`) "
    "to see whether it alone is at fault.",
    "noise": "Look at the sensor that is named: correct `noise` in its sheet if it is that loud; "
    "else the model lacks something, and `rigid discover` on this spec says what could be missing.",
    "converged": "Run again with `--resume` and a larger `max_steps` in `[sampler]`; more starts "
    "help where the ensembles are in different modes.",
    "covered": "Records tell a combination of numbers and hardly its parts, as k_LC and k_frame: "
    "narrow the prior of the part that you know best, or take a record that tells it.",
    "starts": "Raise `starts` in `[sampler]`: the best optimum was found too rarely to be trusted.",
    "optimum": "Look at the number that is named first: its prior may be wrong, or the model lacks "
    "something that pulls it away; `rigid discover` on this spec says what could be missing.",
    "mode weights": "The weights of the modes are not reliable: take a record that tells the modes "
    "apart, or narrow the prior that admits them.",
    "solver": "The fast solver's error matters here: take diffrax in its place, "
    '`[solve] method = "diffrax"` in the spec; it is slower.',
}
"""What to do when a check fails, by its name."""

READY = (
    "Use posterior.nc: `rigid bands` makes ice loads of it; `rigid discover` looks for a missing "
    "effect."
)
OF_A_MACHINE = "Use posterior.nc; `rigid discover` looks for a missing effect."


def front(
    done: Calibrated,
    checks: Sequence[Check],
    numbers: Sequence[KeyNumber],
    choices: Sequence[Alternative],
    curve: FrictionCurve | None,
) -> Front:
    """Question, answers, whether they may be used, what the records cannot say, what to do."""
    failed = [check for check in checks if not check.ok]
    usable = not failed
    parameters = done.problem.parameters
    what, ready = ("rig", READY) if done.problem.of_the_rig else ("machine", OF_A_MACHINE)
    return Front(
        asked=f"What are the {parameters.size} uncertain numbers of this {what}, given "
        f"{len(done.records)} records?",
        state=GOOD if usable else BAD,
        ruling=wording.verdict(usable, checks),
        why=tuple(f"{one.name}: {one.says}" for one in failed) or passed(checks),
        answers=tuple(answer(one, choices) for one in numbers[:MOST_ANSWERS]),
        cannot=(*nothing_learned(done), *unheard(curve), *unsettled(choices)),
        next=tuple(NEXT.get(one.name, f"See the check `{one.name}`.") for one in failed)
        or (ready,),
        figure="friction" if curve is not None else "corner",
    )


def passed(checks: Sequence[Check]) -> tuple[str, ...]:
    """The checks that say most, where all passed."""
    return tuple(f"{one.name}: {one.says}" for one in checks if one.name in ("residuals",))


def answer(number: KeyNumber, choices: Sequence[Alternative]) -> Answer:
    """A key number with its uncertainty, and beside it what another choice makes of it."""
    value = wording.main_form(number)
    said = wording.reading(number)
    if "±" in value:
        ends = metrology.interval(number.q05, number.q95, number.unit)
        said = f"90 % interval {ends}. {said}"
    elif not number.range:
        value = metrology.median_and_interval((number.q05, number.median, number.q95), number.unit)
    others = [
        f"{metrology.median_and_interval((c.q05, c.median, c.q95), c.unit)} with {c.label} (eq. 15)"
        for c in choices
        if not c.used and c.symbol == number.symbol
    ]
    if others:
        said = f"{said.strip()} No record settles the frame: {'; '.join(others)}."
    return Answer(number.label, value, said.strip(), number.symbol)


def nothing_learned(done: Calibrated) -> tuple[str, ...]:
    """Parameters of which the records say nothing, in one sentence."""
    bases = dict.fromkeys(p.base for p in silent(done))
    if not bases:
        return ()
    return (f"Nothing is learned of {wording.listed(list(bases))}: these keep their priors.",)


def unheard(curve: FrictionCurve | None) -> tuple[str, ...]:
    """Frequencies at which friction is the prior's."""
    if curve is None or bool(np.all(curve.informed)):
        return ()
    if not np.any(curve.informed):
        return ("Friction is the prior's at every frequency.",)
    edges = np.flatnonzero(np.diff(curve.informed.astype(int)))
    bounds = [0, *(edges + 1), len(curve.frequency)]
    stretches = [
        f"{metrology.significant(float(curve.frequency[first]), 'Hz', 2)} to "
        f"{metrology.significant(float(curve.frequency[last - 1]), 'Hz', 2)}"
        for first, last in itertools.pairwise(bounds)
        if not curve.informed[first]
    ]
    return (f"Friction rests on the prior at {' and '.join(stretches)}.",)


def unsettled(choices: Sequence[Alternative]) -> tuple[str, ...]:
    """Choices that no record settles."""
    return tuple(
        f"Which are the {question}: {', or '.join(dict.fromkeys(c.label for c in choices))}."
        for question in dict.fromkeys(c.question for c in choices)
    )
