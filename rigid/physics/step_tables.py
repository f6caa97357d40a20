"""Step matrices of a group of slow records: made at a few strokes, interpolated between them.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.drive import STRIDE, Plan
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.step_matrices import DOUBLINGS, doubled, jacobian, step_matrix
from rigid.physics.stroke_range import Strokes

HALVINGS = 2
PARTS = 2**HALVINGS
"""Parts into which a sample is cut where the valve moves or the pump's flow bends."""
HALVED = 2
FINER = 2**HALVED
"""Fine steps into which a part is cut where the flow bends steeply and the valve does not move."""


class Tables(NamedTuple):
    """Step matrices of one group for the current parameters.

    - `low`, `slope`, `bend` (4, n, n, walkers): for fine steps, parts of a sample, samples and long
      steps, coefficients of a parabola through the least stroke (0), the middle and the greatest
      (1).
    - `own` (3, n, n, tracks, walkers): for all but long steps, coefficient of the cubic that goes
      through a track's own greatest stroke as well, where it rings when the valve shuts.
    - `kinks` (kinks + 1, n, walkers): response to a unit rate of pressure from a switch on, to the
      end of its part of a sample.
    """

    low: Array
    slope: Array
    bend: Array
    own: Array
    kinks: Array


def tables(rig: Rig, outside: Surroundings, plan: Plan, strokes: Strokes) -> Tables:
    """Compute the step matrices for all lengths of steps and every switch."""
    scales, part = rig.scales, plan.interval / PARTS
    own = jnp.max(strokes.switch, axis=1)
    middle = strokes.middle(rig.column)
    nodes = jnp.concatenate([jnp.stack([strokes.low, middle, strokes.high]), own])
    at_switch = strokes.switch[plan.kink_place[:, 0], plan.kink_place[:, 1]]
    matrix = jacobian(rig, outside, rig.column + jnp.concatenate([nodes, at_switch]))
    rests = step_matrix(
        matrix[:, :, len(nodes) :],
        plan.within(PARTS)[1][:, None],
        scales,
        DOUBLINGS - HALVINGS,
    )[:, 4]
    matrix = matrix[:, :, : len(nodes)]
    fine = step_matrix(matrix, part / FINER, scales, DOUBLINGS - HALVINGS - HALVED)
    parts = _longer(matrix, fine, FINER)
    samples = _longer(matrix, parts, PARTS)
    long = _longer(matrix[:, :, :3], samples[:, :, :3], STRIDE)
    shared = jnp.stack([fine[:, :, :3], parts[:, :, :3], samples[:, :, :3], long])
    low, mid, high = jnp.moveaxis(shared, 3, 0)
    # The phase of an oscillation over a step turns with the column: a straight line would miss it.
    slope, bend = 4.0 * mid - 3.0 * low - high, 2.0 * (low + high) - 4.0 * mid
    at_own = jnp.stack([fine[:, :, 3:], parts[:, :, 3:], samples[:, :, 3:]])
    place = strokes.place(rig.column, own)
    parabola = (t[:3, :, :, None] for t in (low, slope, bend))
    cubic = _cubic(at_own, place, *parabola)
    none = jnp.zeros((1, len(scales), rests.shape[-1]))
    return Tables(low, slope, bend, cubic, jnp.concatenate([none, jnp.moveaxis(rests, 1, 0)]))


def _longer(matrix: Array, phi: Array, times: int) -> Array:
    """Phi of steps that are so many `times` as long, a power of two."""
    return jax.lax.fori_loop(0, times.bit_length() - 1, lambda _, p: doubled(matrix, p), phi)


def bulge(place: Array) -> Array:
    """Cubic in the place between the nodes that is 0 at all three of them."""
    return place * (place - 0.5) * (place - 1.0)


def _cubic(phi: Array, place: Array, low: Array, slope: Array, bend: Array) -> Array:
    """By how much of `bulge` step matrices at a further node, at `place`, are off the parabola."""
    size = bulge(place)
    at_a_node = jnp.abs(size) < 1e-6
    off = phi - low - place * (slope + place * bend)
    return jnp.where(at_a_node, 0.0, off / jnp.where(at_a_node, 1.0, size))
