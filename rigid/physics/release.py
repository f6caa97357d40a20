"""Quick release: the rig swings free from rest under a preload, valve shut."""

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.rest import rest_under
from rigid.physics.rig import FREE, Rig
from rigid.physics.sensors import readings
from rigid.physics.step_matrices import apply, jacobian, step_matrix

NODE = 1e-3
"""Stroke [m] of the second node of interpolation; a release moves the plunger by tenths of it."""


def ring(rig: Rig, preload: Array, delay: Array, interval: float, samples: int) -> Array:
    """Acceleration of the plate [m/s^2] after a release, (samples, tracks, walkers).

    - `preload` (tracks, walkers) [N]; `delay` (tracks, walkers) [s]: from release to first sample.
    - `interval` [s]: between samples.

    A step is y + Phi f(y) as in `rigid.physics.step_matrices`: the oil column follows the plunger,
    f in the middle of the step and Phi interpolated between two strokes.
    """
    columns = rig.column + jnp.asarray([0.0, NODE])[:, None]
    matrix = jacobian(rig, FREE, columns)
    start = rest_under(rig, preload)

    def tables(length: Array | float) -> tuple[Array, Array]:
        phi = step_matrix(matrix[:, :, :, None], length, rig.scales)
        return phi[:, :, 0], phi[:, :, 1] - phi[:, :, 0]

    def step(flat: Array, table: tuple[Array, Array], length: Array | float, at: Array) -> Array:
        stroke = flat[2] - flat[0] + 0.5 * length * (flat[3] - flat[1])
        outside = FREE._replace(time=at + 0.5 * length)
        rates = jnp.stack(rig.motion(flat, outside, rig.column + stroke).rates)
        return flat + apply(table[0] + stroke / NODE * table[1], rates)

    each = tables(interval)

    def advance(flat: Array, number: Array) -> tuple[Array, Array]:
        time = delay + number * interval
        here = FREE._replace(time=time)
        return step(flat, each, interval, time), readings(rig, flat, here).acceleration

    first = step(start, tables(delay), delay, jnp.zeros(()))
    return jax.lax.scan(advance, first, jnp.arange(samples))[1]
