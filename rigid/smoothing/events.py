"""What happened in a record: falls of the load and movements of the valve."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rigid.smoothing.field import Field
from rigid.smoothing.inputs import FLOW_SIZE
from rigid.smoothing.learning import Learned

WITHIN = 0.1
"""Seconds within which a fall is one fall."""

APART = 0.3
"""Seconds that two events are apart, at least."""

LEAST_SHARE, LEAST_FALL = 0.05, 1.0
"""A fall counts from this share of the greatest load on, and from this many times the typical size
of a load, 1 kN on the rig."""

LEAST_TURN = 0.01
"""Change of kappa that counts as a movement of the valve."""

SETTLED = 0.1
"""Seconds before and after a movement of the valve from which kappa is told."""


@dataclass(frozen=True)
class Fall:
    """The load of a cylinder or joint fell from `before` to `after` [N] about `time` [s]."""

    cylinder: str
    time: float
    before: float
    after: float


@dataclass(frozen=True)
class Turn:
    """The valve of a cylinder or joint moved at `time` [s]: kappa went from `before` to `after`."""

    cylinder: str
    time: float
    before: float
    after: float


def falls(field: Field, learned: Learned) -> tuple[Fall, ...]:
    """Return the falls of a test's loads, place by place in order of time."""
    inputs = field.setup.inputs
    return tuple(
        one
        for at, place in enumerate(inputs.loads)
        for one in _falls(field, place, learned.mean[:, 0, at], LEAST_FALL * inputs.size)
    )


def _falls(field: Field, place: str, load: np.ndarray, least: float) -> Iterator[Fall]:
    span = max(round(WITHIN / field.interval), 1)
    later = np.minimum(np.arange(field.samples) + span, field.samples - 1)
    lost = load - load[later]
    least = max(least, LEAST_SHARE * load.max())
    for at in _peaks(lost, least, round(APART / field.interval)):
        stretch = load[at : at + span + 1]
        steepest = at + int(np.argmin(np.diff(stretch))) if stretch.size > 1 else at
        time = field.first + steepest * field.interval
        yield Fall(place, time, float(stretch.max()), float(stretch.min()))


def turns(field: Field, learned: Learned) -> tuple[Turn, ...]:
    """Return the movements of a test's valves, place by place in order of time."""
    inputs, movement = field.setup.inputs, learned.movement
    sd = FLOW_SIZE * np.sqrt(movement.variances * movement.steps)
    first = 2 * len(inputs.loads)
    return tuple(
        one
        for at, (place, moved) in enumerate(zip(inputs.flows, inputs.flow_places, strict=True))
        for one in _turns(field, place, learned.mean[:, 0, first + at], sd[:, moved])
    )


def _turns(field: Field, place: str, kappa: np.ndarray, sd: np.ndarray) -> Iterator[Turn]:
    settled = max(round(SETTLED / field.interval), 1)
    for at in _peaks(sd, LEAST_TURN / 2, round(APART / field.interval)):
        before = np.median(kappa[max(at - 2 * settled, 0) : max(at - settled, 1)])
        after = (
            np.median(kappa[at + settled : at + 2 * settled])
            if at + settled < len(kappa)
            else before
        )
        if abs(after - before) > LEAST_TURN:
            time = field.first + (at + 0.5) * field.interval
            yield Turn(place, time, float(before), float(after))


def _peaks(values: np.ndarray, least: float, apart: int) -> list[int]:
    """Indices of the greatest values above `least`, at least `apart` samples from each other."""
    found: list[int] = []
    for at in np.argsort(values)[::-1]:
        if values[at] <= least:
            break
        if all(abs(int(at) - other) >= apart for other in found):
            found.append(int(at))
    return sorted(found)
