"""Quick release: the rig swings free from rest under a preload, valve shut."""

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.rig import Rig, Surroundings
from rigid.sensors import readings
from rigid.solve.exponential import apply, jacobian, product, step_matrix

NEWTON_STEPS = 4
"""One is exact for a linear spring; a stiffening one is solved to rounding in four."""


def rest_under(rig: Rig, preload: ArrayLike) -> Array:
    """Return the state at rest under a compressive `preload` [N]: S p = load-cell force = preload.

    Friction is at rest: no force. The stroke counts from here.
    """
    preload = jnp.asarray(preload)
    shape = jnp.broadcast_shapes(preload.shape, rig.column.shape)
    rest = jnp.zeros((len(rig.scales), *shape))

    def excess(x: Array) -> Array:
        return rig.motion(rest.at[0].set(x), Surroundings(), rig.column).load - preload

    x = jnp.zeros(shape)
    for _ in range(NEWTON_STEPS):
        value, slope = jax.jvp(excess, (x,), (jnp.ones(shape),))
        x = x - value / slope
    return rest.at[0].set(x).at[2].set(x).at[4].set(preload / rig.area)


def ring(rig: Rig, preload: Array, delay: Array, interval: float, samples: int) -> Array:
    """Acceleration of the plate [m/s^2] after a release, (samples, tracks, walkers).

    - `preload` (tracks, walkers) [N]; `delay` (tracks, walkers) [s]: from release to first sample.
    - `interval` [s]: between samples.

    The column is frozen: it changes by 0.1 mm in 200 mm (tests hold the error).
    """
    free = Surroundings()
    matrix = jacobian(rig, free, rig.column[None])
    start = rest_under(rig, preload)
    unit = jnp.eye(len(rig.scales))[:, :, None, None]
    first = unit + product(matrix, step_matrix(matrix, delay, rig.scales))
    each = unit + product(matrix, step_matrix(matrix, interval, rig.scales))

    def advance(flat: Array, _: None) -> tuple[Array, Array]:
        return apply(each, flat), readings(rig, flat, free).acceleration

    return jax.lax.scan(advance, apply(first, start), None, length=samples)[1]
