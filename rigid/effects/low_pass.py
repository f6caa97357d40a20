"""A low pass of first order, as sensors and their conditioners have it."""

import jax.numpy as jnp
from jax import Array

QUICKEST = 1e-3
"""Time [s] on which the filter works where nothing lags: a tenth of a sampling interval."""


def following(read: Array, own: Array, time: Array) -> Array:
    """Rate at which a filter's state `own` follows what is `read`, (read - own)/T.

    T^2 = time^2 + (1 ms)^2, which keeps it regular where the `time` [s] of the lag is 0.
    """
    return (read - own) / jnp.hypot(time, QUICKEST)
