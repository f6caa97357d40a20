"""Whether a refit has come to an optimum that can be believed, and why not.

Three things are asked. The gradient vanishes, in posterior sds. No number of the model is where its
prior says that no rig is (`rigid.inference.settled`). And a model that holds another one is not
below it: with an effect near its absence a refit reproduces the fit without the effect, so that one
which ends lower has not found its optimum.
"""

import numpy as np

from rigid.inference.settled import Settled, settled
from rigid.localfit.expansion import added_size
from rigid.localfit.local import Local

NEAR_ABSENCE = 8.0
"""Nats that the prior takes for an effect that is as good as absent: four sds of an amplitude whose
order of magnitude is not known, a ten-thousandth of the usual one."""


def state_of(local: Local) -> Settled:
    """Judge where a refit ended.

    What an added effect's own numbers are far from is its absence, and is left to who weighs it:
    they count for the gradient alone.
    """
    hypothesis = local.hypothesis
    sensors = [f"{part}[{s}]" for s in hypothesis.problem.sensors for part in ("gain", "zero")]
    labels = [*hypothesis.labels, *sensors]
    whole = settled(labels, local.w, local.gradient, local.information)
    base, added = len(hypothesis.parameters), added_size(hypothesis)
    own = set(labels[base - added : base])
    far = tuple((label, sds) for label, sds in whole.far if label not in own)
    return Settled(whole.away, far, whole.limit)


def unsettled(local: Local, without: Local | None = None) -> str:
    """Return why a refit cannot be believed, in a sentence; empty where it can.

    - `without`: a fit of the same samples, weighted the same, of which this one is an extension by
      effects that can be absent.
    """
    why = state_of(local).why
    if without is not None and np.array_equal(without.layout.weight, local.layout.weight):
        lost = without.value - local.value
        if lost > NEAR_ABSENCE * max(len(local.hypothesis.added), 1):
            said = f"the fit lies {lost:.0f} nats below the one without what was added"
            why = f"{why}; {said}" if why else said
    return why
