"""Where the rig rests before a record begins."""

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.io.compiled import compiled
from rigid.physics.rig import Rig, Surroundings

NEWTON_STEPS = 4
"""One is exact for a linear spring; a stiffening one is solved to rounding in four."""


@compiled
def rest_under(rig: Rig, preload: ArrayLike, contact: ArrayLike = 0.0) -> Array:
    """Return the state at rest under a compressive `preload` [N] on the plate: forces balance.

    - `contact` [N/m]: stiffness of a frame that the plate touches.

    The effects' own states are 0: friction is at rest, without a force. The stroke counts from
    here.
    """
    preload = jnp.asarray(preload)
    shape = jnp.broadcast_shapes(preload.shape, rig.column.shape)
    rest = jnp.zeros((len(rig.scales), *shape))
    outside = Surroundings(jnp.asarray(contact), -preload)

    def placed(x: Array, pressure: Array) -> Array:
        return rest.at[0].set(x).at[2].set(x).at[4].set(pressure)

    def excess(x: Array, pressure: Array) -> tuple[Array, Array]:
        rates = rig.motion(placed(x, pressure), outside, rig.column).rates
        return jnp.broadcast_to(rates[1], shape), jnp.broadcast_to(rates[3], shape)

    one, none = jnp.ones(shape), jnp.zeros(shape)

    def newton(_: Array, at: tuple[Array, Array]) -> tuple[Array, Array]:
        (f, g), (f_x, g_x) = jax.jvp(excess, at, (one, none))
        _, (f_p, g_p) = jax.jvp(excess, at, (none, one))
        determinant = f_x * g_p - f_p * g_x
        x, pressure = at
        return x - (f * g_p - g * f_p) / determinant, pressure - (g * f_x - f * g_x) / determinant

    return placed(*jax.lax.fori_loop(0, NEWTON_STEPS, newton, (none, none)))
