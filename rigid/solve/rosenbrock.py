"""Exponential Rosenbrock steps with the Jacobian of the moment: for rigs that are not steady.

A step is y + Phi(h, J) f(y) with J the exact Jacobian at y, second order in h whatever the
stiffness: exact where the motion is linear, stable through stiff bristles, air in the oil or a
contact that closes. Phi is made anew for every step, which costs some ten times the tables of
`rigid.solve.exponential`; a record takes this way only if an effect of its rig is not `steady`, or
if its pressure comes near the bend of the pump's curve.
Source: Hochbruck and Ostermann 2010, Acta Numerica 19, sec. 2.4, eq. (2.54).

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.rig import FREE, Rig, Surroundings
from rigid.solve.drive import Plan
from rigid.solve.exponential import apply, at_samples, sampled, step_matrix
from rigid.solve.rest import rest_under

SETTLING = 0.15
"""Seconds after a switch of the valve in which the rig rings, and a bristle turns over with it."""
FINE, COARSE = 12, 2
"""Substeps between two nodes of a plan while it rings, and later."""


def rates(rig: Rig, flat: Array, outside: Surroundings) -> Array:
    """Rates of a flat state as one array, (states, ...)."""
    moved = rig.motion(flat, outside).rates
    return jnp.stack([jnp.broadcast_to(r, flat.shape[1:]) for r in moved])


def step(rig: Rig, flat: Array, outside: Surroundings, length: Array | float) -> Array:
    """Lead a flat state (states, tracks, walkers) on by `length` [s], which broadcasts."""

    def along(i: Array) -> tuple[Array, Array]:
        unit = jnp.zeros_like(flat).at[i].set(1.0)
        return jax.jvp(lambda y: rates(rig, y, outside), (flat,), (unit,))

    moved, columns = jax.vmap(along, out_axes=(None, 1))(jnp.arange(flat.shape[0]))
    return flat + apply(step_matrix(columns, length, rig.scales), moved)


class Schedule(NamedTuple):
    """Substeps of a plan, one after the other.

    - `length` [s], `level`, `time` [s]: how long each is, which flow fraction applies and when its
      middle is, (substeps, tracks). - `node` (nodes,): substeps done when a node is reached.
    """

    length: np.ndarray
    level: np.ndarray
    time: np.ndarray
    node: np.ndarray


def schedule(plan: Plan) -> Schedule:
    """Part the steps of a plan into substeps; a switch inside a step parts it, too."""
    span = np.diff(plan.nodes) * plan.interval
    rest = np.concatenate([[0.0], plan.kink_rest])[plan.kink]
    after = np.concatenate([[0], plan.kink_level]).astype(int)[plan.kink]
    counts = np.where(_ringing(plan), FINE, COARSE)
    length, level, time = [], [], []
    for i, count in enumerate(counts):
        kinked = plan.kink[i] > 0
        first = np.where(kinked, span[i] - rest[i], span[i] / count)
        lengths = np.stack([first] + [(span[i] - first) / (count - 1)] * (count - 1))
        later = np.where(kinked, after[i], plan.levels[i])
        length.append(lengths)
        level.append(np.stack([plan.levels[i]] + [later] * (count - 1)))
        begin = plan.nodes[i] * plan.interval
        time.append(begin + np.cumsum(lengths, axis=0) - 0.5 * lengths)
    node = np.concatenate([[0], np.cumsum(counts)])
    return Schedule(np.concatenate(length), np.concatenate(level), np.concatenate(time), node)


def _ringing(plan: Plan) -> np.ndarray:
    """Mark the steps that begin within SETTLING after a switch of some drive, or hold one."""
    changed = np.any(np.diff(plan.levels, axis=0, prepend=plan.levels[:1]) != 0, axis=1)
    changed |= np.any(plan.kink > 0, axis=1)
    changed[0] = True
    begin = plan.nodes[:-1] * plan.interval
    last = np.maximum.accumulate(np.where(changed, begin, -np.inf))
    return begin - last < SETTLING


def march(rig: Rig, contact: Array, fractions: Array, plan: Plan) -> dict[str, Array]:
    """Simulate a group of slow records from rest; arguments and result as `exponential.march`."""
    table = schedule(plan)
    track = jnp.arange(fractions.shape[1])

    def advance(flat: Array, part: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        length, level, time = part
        outside = Surroundings(contact, 0.0, fractions[level, track], time[:, None])
        new = step(rig, flat, outside, length[:, None])
        return new, new

    start = jnp.broadcast_to(
        rest_under(rig, 0.0, contact)[:, None], (len(rig.scales), *fractions.shape[1:])
    )
    parts = (jnp.asarray(table.length), jnp.asarray(table.level), jnp.asarray(table.time))
    path = jax.lax.scan(advance, start, parts)[1]
    path = jnp.concatenate([start[None], path])[table.node]
    flat = jnp.moveaxis(path, 1, 0)
    levels = np.concatenate([plan.levels, plan.levels[-1:]])
    time = jnp.asarray(plan.nodes * plan.interval)[:, None, None]
    outside = Surroundings(contact, 0.0, fractions[levels, track], time)
    values, slopes = sampled(rig, flat, rates(rig, flat, outside), outside)
    return at_samples(plan, jnp.moveaxis(values, 0, 1), jnp.moveaxis(slopes, 0, 1))


def ring(rig: Rig, preload: Array, delay: Array, interval: float, samples: int) -> Array:
    """Acceleration of the plate after a release; arguments and result as `release.ring`."""
    start = step(rig, rest_under(rig, preload), FREE, delay)

    def advance(flat: Array, _: None) -> tuple[Array, Array]:
        return step(rig, flat, FREE, interval), rig.motion(flat, FREE).plunger_acceleration

    return jax.lax.scan(advance, start, None, length=samples)[1]
