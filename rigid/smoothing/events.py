"""What happened in a record: falls of the load and movements of the valve."""

from dataclasses import dataclass

import numpy as np

from rigid.smoothing.field import Field
from rigid.smoothing.learning import Learned
from rigid.smoothing.model import KAPPA, LATENT_SCALES

WITHIN = 0.1
"""Seconds within which a fall is one fall."""

APART = 0.3
"""Seconds that two events are apart, at least."""

LEAST_SHARE, LEAST_FALL = 0.05, 1e3
"""A fall counts from this share of the greatest load on, and from this many newtons."""

LEAST_TURN = 0.01
"""Change of kappa that counts as a movement of the valve."""

SETTLED = 0.1
"""Seconds before and after a movement of the valve from which kappa is told."""


@dataclass(frozen=True)
class Fall:
    """The load of a cylinder fell from `before` to `after` [N] about `time` [s]."""

    cylinder: str
    time: float
    before: float
    after: float


@dataclass(frozen=True)
class Turn:
    """The valve of a cylinder moved at `time` [s]: kappa went from `before` to `after`."""

    cylinder: str
    time: float
    before: float
    after: float


def falls(field: Field, learned: Learned) -> tuple[Fall, ...]:
    """Return the falls of a record's load in order of time."""
    load = learned.mean[:, 0, 0]
    span = max(round(WITHIN / field.interval), 1)
    later = np.minimum(np.arange(field.samples) + span, field.samples - 1)
    lost = load - load[later]
    least = max(LEAST_FALL, LEAST_SHARE * load.max())
    out = []
    for at in _peaks(lost, least, round(APART / field.interval)):
        stretch = load[at : at + span + 1]
        steepest = at + int(np.argmin(np.diff(stretch))) if stretch.size > 1 else at
        time = field.first + steepest * field.interval
        out.append(Fall(field.cylinder, time, float(stretch.max()), float(stretch.min())))
    return tuple(out)


def turns(field: Field, learned: Learned) -> tuple[Turn, ...]:
    """Return the movements of a record's valve in order of time."""
    kappa = learned.mean[:, 0, 2]
    sd = np.sqrt(learned.movement.variances[:, KAPPA] * learned.movement.steps)
    settled = max(round(SETTLED / field.interval), 1)
    out = []
    for at in _peaks(sd * LATENT_SCALES[KAPPA], LEAST_TURN / 2, round(APART / field.interval)):
        before = np.median(kappa[max(at - 2 * settled, 0) : max(at - settled, 1)])
        after = (
            np.median(kappa[at + settled : at + 2 * settled])
            if at + settled < len(kappa)
            else before
        )
        if abs(after - before) > LEAST_TURN:
            time = field.first + (at + 0.5) * field.interval
            out.append(Turn(field.cylinder, time, float(before), float(after)))
    return tuple(out)


def _peaks(values: np.ndarray, least: float, apart: int) -> list[int]:
    """Indices of the greatest values above `least`, at least `apart` samples from each other."""
    found: list[int] = []
    for at in np.argsort(values)[::-1]:
        if values[at] <= least:
            break
        if all(abs(int(at) - other) >= apart for other in found):
            found.append(int(at))
    return sorted(found)
