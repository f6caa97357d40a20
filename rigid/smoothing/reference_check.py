"""The steps of the smoother held against diffrax, along the loads and flows that it inferred.

Smoothed means obey the smoother's own steps exactly. So the rig's equations are solved by diffrax
from the state at which a stretch begins, under the ice load and kappa that the smoother says; what
the sensors then read is compared with what it says they read.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.inference.reference_check import SensorError, SolverCheck
from rigid.io.compiled import compiled
from rigid.physics.full import TOLERANCE, Given, driven
from rigid.physics.sensors import UNITS
from rigid.smoothing.field import Channel, Field, liveliest
from rigid.smoothing.kalman import Filtered
from rigid.smoothing.laws import RigModel, draws
from rigid.smoothing.model import scales
from rigid.smoothing.run import Way
from rigid.smoothing.smoother import STEPS, DrawBatch, Evidence, filtered, last_state, smoothed
from rigid.spec.sheets import SensorsSpec

WINDOW = 2
"""Blocks that are solved again, 10 s at 100 Hz: those in which the load's readings change most."""

POINTS = 8
"""Rigs that are solved again: the posterior's centre and draws."""


class Inferred(NamedTuple):
    """What the smoother says of a stretch for each draw, in SI.

    - `start` (draws, n): state of the plant at its first sample. - `straight` (draws, steps + 1,
      inputs): loads [N] and what was recorded; `flows` (draws, steps, flows). - `read` (draws,
      samples, channels).
    """

    start: Array
    straight: np.ndarray
    flows: np.ndarray
    read: np.ndarray


def against_reference(
    ways: Sequence[Way], sensors: SensorsSpec, tolerance: float = TOLERANCE
) -> tuple[SolverCheck, ...]:
    """Solve the liveliest stretch of every record again under each law; `sensors`: sheets."""
    return tuple(
        _checked(field, evidence, way.model, sensors, tolerance)
        for way in ways
        for field, evidence in zip(way.test.fields, way.test.evidence, strict=True)
    )


def _checked(
    field: Field, evidence: Evidence, law: RigModel, sensors: SensorsSpec, tolerance: float
) -> SolverCheck:
    """The check of one record under one law."""
    centre = law.centre()
    some = law.only(np.arange(min(POINTS - 1, law.size)))
    joined = {
        k: np.concatenate([v, np.broadcast_to(some.values[k], some.size)])
        for k, v in centre.values.items()
    }
    rigs = draws(replace(law, weight=1.0, values=joined), field)
    here = liveliest(field, WINDOW)
    part = field.cut(here.start, here.stop)
    given = Evidence(evidence.reading[here], evidence.variance[here], evidence.moves[here])
    start = None
    if here.start > 0:
        before = slice(0, here.start)
        known = Evidence(
            evidence.reading[before], evidence.variance[before], evidence.moves[before]
        )
        one = last_state(field.cut(0, here.start), draws(centre, field), known)
        wide = len(joined[next(iter(joined))])
        start = jax.tree.map(lambda leaf: jnp.repeat(leaf, wide, axis=0), one)
    told = inferred(part, rigs, given, start)
    full = _read(rigs, told, part.interval / STEPS, tolerance)
    return _compared(part, told.read, np.asarray(full), sensors, tolerance)


def inferred(part: Field, rigs: DrawBatch, given: Evidence, start: Filtered | None) -> Inferred:
    """Smooth a stretch and put together what drives the rig in it."""
    begins = filtered(part, rigs, given, None, start)
    found = list(smoothed(part, rigs, given, None, begins))
    moved, read = ([np.asarray(getattr(b, n)) for _, b, _ in found] for n in ("moved", "read"))
    _, _, later = found[
        -1
    ]  # what all samples say: the smoothed mean is mean + covariance @ adjoint
    samples, inputs = part.samples, part.setup.inputs
    steps = np.concatenate(moved[::-1], axis=1)[:, : samples - 1]
    steps = steps.reshape(len(steps), -1, inputs.count) * np.array(inputs.scales)
    state = (begins[0].mean + begins[0].covariance @ later.adjoint)[..., 0]
    size = jax.vmap(scales, in_axes=-1)(rigs.plant)
    own = size.shape[-1] - inputs.count
    first = np.asarray(state * size)[:, own:]
    driving, many = _summed(first, steps), inputs.straight
    slopes = driving[:, :, many : 2 * many]
    rising = slopes[:, :-1] * part.interval / STEPS
    return Inferred(
        start=(state * size)[:, :own],
        straight=driving[:, :, :many] + _summed(np.zeros((len(steps), many)), rising),
        flows=driving[:, :-1, 2 * many :],
        read=np.concatenate(read[::-1], axis=1)[:, :samples],
    )


def _summed(first: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Values before each move and after the last, (draws, moves + 1, inputs)."""
    begun = first[:, None]
    return np.concatenate([begun, begun + np.cumsum(moves, axis=1)], axis=1)


@compiled
def _read(rigs: DrawBatch, told: Inferred, length: float, tolerance: float) -> Array:
    """What the sensors read of the full solve, (draws, samples, channels)."""

    def one(draw: DrawBatch, start: Array, straight: Array, flows: Array) -> Array:
        plant, given = draw.plant, Given(straight, flows, length)
        states = driven(plant.rates, plant.scales, start, given, tolerance)
        passed = jnp.concatenate([flows, flows[-1:]])
        at = [each[::STEPS] for each in (states, straight, passed)]
        ideal = jax.vmap(plant.read)(*at)
        return (1.0 + draw.sensors.gain) * ideal + draw.sensors.zero

    drives = (jnp.asarray(told.straight), jnp.asarray(told.flows))
    return jax.vmap(one, in_axes=(-1, 0, 0, 0))(rigs, told.start, *drives)


def _compared(
    part: Field,
    fast: np.ndarray,
    full: np.ndarray,
    sheets: SensorsSpec,
    tolerance: float,
) -> SolverCheck:
    """Compare readings by the smoother's steps with those of the full solve.

    - `fast`, `full` (draws, samples, channels).
    """
    ended = np.array([np.isfinite(one).all() for one in full])
    error = np.abs(full - fast)[ended].max(axis=(0, 1), initial=0.0)
    read = [(part.setup.channels[number], error[number]) for number in part.setup.read]
    sensors = tuple(
        SensorError(q, UNITS[q], float(e), s.step or s.noise, "step" if s.step else "noise", where)
        for q, e, s, where in (
            (c.quantity, e, sheets[c.quantity], _where(part, c)) for c, e in read
        )
    )
    return SolverCheck(
        tolerance=tolerance,
        points=len(ended),
        ended=int(ended.sum()),
        sensors=sensors if ended.any() else (),
    )


def _where(part: Field, channel: Channel) -> str:
    """Record and place of a channel."""
    return f"{part.name},{channel.place}"
