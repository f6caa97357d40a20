"""Step matrices of a group of slow records: made at a few strokes, interpolated between them.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from functools import reduce
from operator import mul
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.drive import STRIDE, Plan
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.step_matrices import DOUBLINGS, jacobian, longer, step_column, step_matrix
from rigid.physics.stroke_range import Strokes

HALVINGS = 2
PARTS = 2**HALVINGS
"""Parts into which a sample is cut where the valve moves or the pump's flow bends."""
HALVED = 2
FINER = 2**HALVED
"""Fine steps into which a part is cut where the flow bends steeply and the valve does not move."""

NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(5) / 4)
"""Places of the nodes of Chebyshev and Lobatto between the least stroke (0) and the greatest (1).
The phase of an oscillation over a sample turns by some radians between them. Through three nodes a
parabola was off by half a percent a step, which friction hides unless there is hardly any: where a
rig of 520 N s/m rang on for seconds, by 0.8 steps of the gauge."""


class Tables(NamedTuple):
    """Step matrices of one group for the current parameters.

    - `powers` (nodes, 4, n, n, walkers): for fine steps, parts of a sample, samples and long
      steps, coefficients of a polynomial through NODES, of the lowest power first.
    - `own` (3, n, n, tracks, walkers): for all but long steps, coefficient of one more power, so
      that it goes through a track's own greatest stroke as well, where it rings when the valve
      shuts.
    - `kinks` (kinks + 1, n, walkers): response to a unit rate of pressure from a switch on, to the
      end of its part of a sample.
    """

    powers: Array
    own: Array
    kinks: Array


def tables(rig: Rig, outside: Surroundings, plan: Plan, strokes: Strokes) -> Tables:
    """Compute the step matrices for all lengths of steps and every switch."""
    scales, part = rig.scales, plan.interval / PARTS
    own = jnp.max(strokes.switch, axis=1)
    count = len(NODES)
    shared = jnp.stack([strokes.at(rig.column, place) for place in NODES.tolist()])
    nodes = jnp.concatenate([shared, own])
    at_switch = strokes.switch[plan.kink_place[:, 0], plan.kink_place[:, 1]]
    matrix = jacobian(rig, outside, rig.column + jnp.concatenate([nodes, at_switch]))
    rests = step_column(
        matrix[:, :, len(nodes) :],
        plan.within(PARTS)[1][:, None],
        scales,
        4,
        DOUBLINGS - HALVINGS,
    )
    matrix = matrix[:, :, : len(nodes)]
    fine = step_matrix(matrix, part / FINER, scales, DOUBLINGS - HALVINGS - HALVED)
    parts = longer(matrix, fine, HALVED)
    samples = longer(matrix, parts, HALVINGS)
    long = longer(matrix[:, :, :count], samples[:, :, :count], STRIDE.bit_length() - 1)
    known = [one[:, :, :count] for one in (fine, parts, samples, long)]
    powers = jnp.einsum("kp,lijpw->klijw", _FITTED, jnp.stack(known))
    at_own = jnp.stack([one[:, :, count:] for one in (fine, parts, samples)])
    further = _further(at_own, strokes.place(rig.column, own), powers[:, :3, :, :, None])
    none = jnp.zeros((1, len(scales), rests.shape[-1]))
    return Tables(powers, further, jnp.concatenate([none, jnp.moveaxis(rests, 1, 0)]))


_FITTED = np.linalg.inv(np.vander(NODES, increasing=True))
"""From values at NODES to coefficients, lowest power first."""


def polynomial(powers: Array, place: Array) -> Array:
    """Value at a place; `powers` (nodes, ...), lowest power first."""
    value = powers[-1]
    for power in powers[-2::-1]:
        value = power + place * value
    return value


def bulge(place: Array) -> Array:
    """Polynomial in the place that is 0 at all NODES."""
    return reduce(mul, (place - node for node in NODES.tolist()))


def _further(phi: Array, place: Array, powers: Array) -> Array:
    """By how much of `bulge` step matrices at a further node, at `place`, are off the rest."""
    size = bulge(place)
    at_a_node = jnp.abs(size) < 1e-9
    off = phi - polynomial(powers, place)
    return jnp.where(at_a_node, 0.0, off / jnp.where(at_a_node, 1.0, size))
