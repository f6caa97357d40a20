"""Whether a refit has come to an optimum that can be believed, and why not.

Three things are asked. The gradient vanishes, in posterior sds. No number of the model is where its
prior says that no rig is (`rigid.inference.settled`). And a model that holds another one is not
below it: with an effect near its absence a refit reproduces the fit without the effect, so that one
which ends lower has not found its optimum. The numbers of an added effect may go where it is
absent, not where it is another law.
"""

import numpy as np

from rigid.effects.base import AbstractEffect
from rigid.inference.settled import Settled, away_from_top, settled
from rigid.likelihood.priors import Lognormal
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.local import LocalFit

NEAR_ABSENCE = 8.0
"""Nats that the prior takes for an effect that is as good as absent: four sds of an amplitude whose
order of magnitude is not known, a ten-thousandth of the usual one."""


def labels_of(hypothesis: Hypothesis) -> list[str]:
    """Labels of the entries of w: of the model, of every sensor, of what was absorbed."""
    sensors = (f"{part}[{s}]" for s in hypothesis.problem.sensors for part in ("gain", "zero"))
    absorbed = (label for one in hypothesis.absorbed for label in one.labels)
    return [*hypothesis.labels, *sensors, *absorbed]


def nearer_priors(local: LocalFit) -> list[np.ndarray]:
    """Other places w (size,) to begin from where a fit has left the priors; none where it has not.

    With the numbers that are too far at the centres of their priors, and with all numbers there:
    what a missing effect has pulled away does not find back along the slope it was led down.
    """
    far = {label for label, _ in state_of(local).far}
    if not far:
        return []
    away = np.array([label in far for label in labels_of(local.hypothesis)])
    return [np.where(away, 0.0, local.w), np.zeros(len(local.w))]


def state_of(local: LocalFit, borne: float = 0.0) -> Settled:
    """Judge where a refit ended.

    - `borne`: nats that numbers may cost in their priors for the discrepancy of laws that were
      added: what a law leaves shows in the residuals, or in the numbers that take it up.

    What an added effect's own numbers are far from is its absence, and is left to who weighs it:
    they count for the gradient alone, but for those that make another law of it (`another_law`);
    so do those of what was absorbed.
    """
    hypothesis, away = local.hypothesis, away_from_top(local.gradient, local.information)
    whole, own = settled(labels_of(hypothesis), local.w, away), _own_labels(hypothesis)
    other = tuple(far for effect in hypothesis.added for far in another_law(local, effect))
    far = tuple((label, sds) for label, sds in whole.far if label not in own)
    if far and 0.5 * sum(sds**2 for _, sds in far) <= borne:
        return Settled(whole.away, other, whole.limit, driven=far)
    return Settled(whole.away, (*other, *far), whole.limit)


def another_law(local: LocalFit, effect: type[AbstractEffect]) -> tuple[tuple[str, float], ...]:
    """Numbers of an added effect that make another law of it, and by how many prior sds.

    Its scales (widths, bendings, times: lognormal, without a value at which it is absent) may
    vanish: what is left is the limit of the law, a step, dry friction. One far above its prior
    leaves no law of the kind: a bristle that bends by four centimetres before it slides is a
    spring. Where a great scale is a limit, too, as of the flow at which fittings matter, readings
    no longer depend on it, and nothing drives it there.
    """
    hypothesis = local.hypothesis
    shape = {n for info in effect.parameters() if info.absent is None for n in info.labels}
    own = [p for p in hypothesis.brought_by(effect) if isinstance(p.prior, Lognormal)]
    scales = shape & {p.label for p in own}
    far = settled(labels_of(hypothesis), local.w, 0.0).far
    return tuple((label, sds) for label, sds in far if label in scales and sds > 0.0)


def _own_labels(hypothesis: Hypothesis) -> set[str]:
    """Labels of the numbers of what was added and of what was absorbed."""
    base, added = len(hypothesis.parameters), _added_size(hypothesis)
    absorbed = (label for one in hypothesis.absorbed for label in one.labels)
    return {*hypothesis.labels[base - added : base], *absorbed}


def _added_size(hypothesis: Hypothesis) -> int:
    """Number of parameters of what was added."""
    inside = {p.label for p in hypothesis.problem.parameters.sampled}
    return sum(p.label not in inside for p in hypothesis.parameters)


def unsettled(local: LocalFit, without: LocalFit | None = None, borne: float = 0.0) -> str:
    """Return why a refit cannot be believed, in a sentence; empty where it can.

    - `borne`: as in `state_of`.
    - `without`: a fit of the same samples, weighted the same, of which this one is an extension by
      effects that can be absent.
    """
    why = state_of(local, borne).why
    if without is not None and below(local, without):
        lost = without.value - local.value
        said = f"the fit lies {lost:.0f} nats below the one without what was added"
        why = f"{why}; {said}" if why else said
    return why


def below(local: LocalFit, without: LocalFit) -> bool:
    """Whether a fit lies below one that it holds, by more than the prior takes for absence."""
    if not np.array_equal(without.layout.weight, local.layout.weight):
        return False
    more = len(local.hypothesis.added) - len(without.hypothesis.added)
    return without.value - local.value > NEAR_ABSENCE * max(more, 1)
