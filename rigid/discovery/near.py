"""A fit whose numbers stay where their priors are: what effects explain is judged around it, too.

A model that lacks something leaves the priors for want of it: friction whose memory is five prior
sds too long stands for a return spring. Around such a fit the missing effect explains little, since
what it would explain has been explained away, and others explain more. So the numbers that have
gone too far are held at the centres of their priors, the others are fitted anew, and what explains
most of what is then left over is fitted in full beside what explains most around the fit itself.
"""

import dataclasses

import numpy as np

from rigid.localfit.ascent import refined
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.local import LocalFit
from rigid.localfit.settled import state_of


def held_near(local: LocalFit) -> LocalFit | None:
    """The fit with numbers that have left their priors held at their centres.

    None where none has, or where the rest cannot follow.
    """
    far = {label for label, _ in state_of(local).far}
    hypothesis = local.hypothesis
    gone = [i for i, label in enumerate(hypothesis.labels) if label in far]
    if not gone:
        return None
    centres = {
        hypothesis.labels[i]: float(hypothesis.parameters[i].prior.from_standard(0.0)) for i in gone
    }
    holding = dataclasses.replace(hypothesis, held=dict(hypothesis.held) | centres)
    point = Point(holding, local.layout, np.delete(local.w, gone), local.z_noise)
    begun = expanded(local.family, point)
    found = refined(begun) if begun.finite else begun
    return found if found.finite else None


def let_go(near: LocalFit, like: LocalFit) -> np.ndarray:
    """Place w (size,) of a fit, `like` one in which nothing is held, its held numbers at 0."""
    held = set(near.hypothesis.held)
    free = [i for i, label in enumerate(like.hypothesis.labels) if label not in held]
    sensors = range(len(like.hypothesis.labels), len(like.w))
    w = np.zeros(len(like.w))
    w[[*free, *sensors]] = near.w
    return w
