"""The steps of the smoother held against diffrax, along the loads and flows that it inferred.

Smoothed means obey the smoother's own steps exactly. So the rig's equations are solved by diffrax
from the state at which a stretch begins, under the ice load and kappa that the smoother says; what
the sensors then read is compared with what it says they read.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.inference.reference_check import SensorError, SolverCheck
from rigid.physics.full import TOLERANCE, driven
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import UNITS, readings
from rigid.smoothing.field import Field, liveliest
from rigid.smoothing.kalman import Filtered
from rigid.smoothing.laws import RigModel, draws
from rigid.smoothing.model import LATENT_SCALES, QUANTITIES, scales
from rigid.smoothing.run import Way
from rigid.smoothing.smoother import STEPS, DrawBatch, Evidence, filtered, last_state, smoothed
from rigid.spec.sheets import SensorSpec

WINDOW = 2
"""Blocks that are solved again, 10 s at 100 Hz: those in which the load's readings change most."""

POINTS = 8
"""Rigs that are solved again: the posterior's centre and draws."""


class Inferred(NamedTuple):
    """What the smoother says of a stretch for each draw, in SI.

    - `start` (draws, n): state of the rig at its first sample. - `load` (draws, steps + 1) [N];
      `kappa` (draws, steps). - `read` (draws, samples, 3).
    """

    start: Array
    load: np.ndarray
    kappa: np.ndarray
    read: np.ndarray


def against_reference(
    ways: Sequence[Way], sensors: Sequence[SensorSpec], tolerance: float = TOLERANCE
) -> tuple[SolverCheck, ...]:
    """Solve the liveliest stretch of every cylinder again, under each law.

    - `sensors`: sheets of load, stroke and pressure.
    """
    return tuple(
        _checked(field, evidence, way.model, sensors, tolerance)
        for way in ways
        for field, evidence in zip(way.test.fields, way.test.evidence, strict=True)
    )


def _checked(
    field: Field, evidence: Evidence, law: RigModel, sensors: Sequence[SensorSpec], tolerance: float
) -> SolverCheck:
    """The check of one cylinder's record under one law."""
    centre = law.centre()
    some = law.only(np.arange(min(POINTS - 1, law.size)))
    joined = {
        k: np.concatenate([v, np.broadcast_to(some.values[k], some.size)])
        for k, v in centre.values.items()
    }
    rigs = draws(RigModel(law.name, 1.0, law.effects, joined, law.labels), field)
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
    samples = part.samples
    steps = np.concatenate(moved[::-1], axis=1)[:, : samples - 1]
    steps = steps.reshape(len(steps), -1, 3) * np.array(LATENT_SCALES)
    state = (begins[0].mean + begins[0].covariance @ later.adjoint)[..., 0]
    size = jax.vmap(scales, in_axes=-1)(rigs.rig)
    first = np.asarray(state * size)[:, -3:]
    load, slope, kappa = (_summed(first[:, i], steps[..., i]) for i in range(3))
    rising = slope[:, :-1] * part.interval / STEPS
    return Inferred(
        start=(state * size)[:, :-3],
        load=load + _summed(np.zeros(len(load)), rising),
        kappa=kappa[:, :-1],
        read=np.concatenate(read[::-1], axis=1)[:, :samples],
    )


def _summed(first: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Values before each move and after the last, (draws, moves + 1)."""
    return np.concatenate([first[:, None], first[:, None] + np.cumsum(moves, axis=1)], axis=1)


@eqx.filter_jit
def _read(rigs: DrawBatch, told: Inferred, length: float, tolerance: float) -> Array:
    """What the sensors read of the full solve, (draws, samples, 3)."""

    def one(draw: DrawBatch, start: Array, load: Array, kappa: Array) -> Array:
        states = driven(draw.rig, start, -load, kappa, length, tolerance)
        flows = jnp.append(kappa, kappa[-1])
        at = [each[::STEPS] for each in (states, load, flows)]
        ideal = jax.vmap(partial(_ideal, draw.rig))(*at)
        return (1.0 + draw.sensors.gain) * ideal + draw.sensors.zero

    drives = (jnp.asarray(told.load), jnp.asarray(told.kappa))
    return jax.vmap(one, in_axes=(-1, 0, 0, 0))(rigs, told.start, *drives)


def _ideal(rig: Rig, flat: Array, load: Array, kappa: Array) -> Array:
    """Readings (3,) without gain and zero."""
    read = readings(rig, flat, Surroundings(force=-load, flow_fraction=kappa))[:3]
    return jnp.stack([jnp.broadcast_to(r, ()) for r in read])


def _compared(
    part: Field,
    fast: np.ndarray,
    full: np.ndarray,
    sheets: Sequence[SensorSpec],
    tolerance: float,
) -> SolverCheck:
    """Compare readings by the smoother's steps with those of the full solve (draws, samples, 3)."""
    ended = np.array([np.isfinite(one).all() for one in full])
    label = part.label
    error = np.abs(full - fast)[ended].max(axis=(0, 1), initial=0.0)
    sensors = tuple(
        SensorError(q, UNITS[q], float(e), s.step or s.noise, "step" if s.step else "noise", label)
        for q, e, s in zip(QUANTITIES, error, sheets, strict=True)
    )
    return SolverCheck(
        tolerance=tolerance,
        points=len(ended),
        ended=int(ended.sum()),
        sensors=sensors if ended.any() else (),
    )
