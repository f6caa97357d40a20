"""Series whose time stamps lag: what was read at t is what was there a delay before."""

from collections.abc import Mapping

import jax.numpy as jnp
from jax import Array


def delayed(
    readings: Mapping[str, Array], delays: Mapping[str, Array], interval: float
) -> dict[str, Array]:
    """Shift readings (samples, tracks, walkers) by the delays (walkers,) [s] of their quantities.

    Between samples lies the cubic through four neighbours (Catmull and Rom 1974); before the first
    sample and after the last the series stands still.
    """
    return {
        quantity: _shifted(series, delays[quantity] / interval) if quantity in delays else series
        for quantity, series in readings.items()
    }


def _shifted(series: Array, lag: Array) -> Array:
    """Values of a series `lag` (walkers,) sampling intervals earlier."""
    whole = jnp.floor(lag)
    u = (1.0 - (lag - whole))[None, None, :]
    index = jnp.arange(series.shape[0])[:, None] - whole.astype(int)[None, :] - 1

    def at(offset: int) -> Array:
        rows = jnp.clip(index + offset, 0, series.shape[0] - 1)[:, None, :]
        return jnp.take_along_axis(series, rows, axis=0)

    a, b, c, d = (at(offset) for offset in (-1, 0, 1, 2))
    return b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)))
