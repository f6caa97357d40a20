"""Series whose time stamps lag: what was read at t is what was there a delay before.

Between two samples lies the cubic through both and their rates of change, each as it is within that
interval. A cubic through neighbours alone would spread a jump of the pressure, where the valve
switches, over the samples beside it, though a delay of half a millisecond moves none of them there.
"""

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import readings

READ = ("load", "stroke", "pressure")
"""What is read of slow records."""


def late(rig: Rig) -> tuple[int, ...]:
    """Places in READ of what has time stamps that lag."""
    lags = rig.delays()  # of an effect of one's own perhaps what no slow record reads
    return tuple(i for i, quantity in enumerate(READ) if quantity in lags)


def in_motion(rig: Rig, flat: Array, outside: Surroundings) -> tuple[Array, Array]:
    """Readings (3, ...) of a flat state and how fast they change."""
    shape = flat.shape[1:]
    rates = rig.motion(flat, outside).rates
    along = jnp.stack([jnp.broadcast_to(r, shape) for r in rates])
    return jax.jvp(lambda y: _read(rig, y, outside), (flat,), (along,))


def stepped(rig: Rig, begin: tuple[Array, Surroundings], end: tuple[Array, Surroundings]) -> Array:
    """What is read where a step begins; `begin`, `end`: flat states and surroundings there.

    Returns readings (3, ...), beneath them how fast those that lag change where the step begins
    and where it ends: where the valve switches these are not those of the steps beside it.
    """
    if not late(rig):
        return _read(rig, *begin)
    values, rates = in_motion(rig, *begin)
    return with_late(rig, values, rates, in_motion(rig, *end)[1])


def with_late(rig: Rig, values: Array, *rates: Array) -> Array:
    """Put the rates of what lags beneath readings; all (..., 3, tracks, walkers)."""
    rows = [one[..., i : i + 1, :, :] for one in rates for i in late(rig)]
    return jnp.concatenate([values, *rows], axis=-3)


def _read(rig: Rig, flat: Array, outside: Surroundings) -> Array:
    shape = flat.shape[1:]
    return jnp.stack([jnp.broadcast_to(r, shape) for r in readings(rig, flat, outside)[:3]])


def on_record(
    rig: Rig, series: Array, end: tuple[Array, Surroundings], interval: float
) -> dict[str, Array]:
    """What stands on record (samples, tracks, walkers), by quantity.

    - `series` (samples - 1, rows, tracks, walkers): what `stepped` gives of each step between two
      samples. - `end`: flat state and surroundings at the last sample. - `interval` [s].
    """
    last = _read(rig, *end)[None]
    lags, places, count = rig.delays(), late(rig), len(READ)
    out = {}
    for i, name in enumerate(READ):
        out[name] = jnp.concatenate([series[:, i], last[:, i]])
        if i in places:
            at = count + places.index(i)
            rates = interval * series[:, at], interval * series[:, at + len(places)]
            out[name] = delayed(out[name], rates, lags[name] / interval)
    return out


def delayed(series: Array, rates: tuple[Array, Array], lag: Array) -> Array:
    """Shift a series (samples, tracks, walkers) by `lag` (walkers,) sampling intervals.

    - `rates` (samples - 1, tracks, walkers): by how much it changes an interval, where each
      interval begins and where it ends. Before the first sample and after the last it stands still.
    """
    whole = jnp.floor(lag)
    u = (1.0 - (lag - whole))[None, None, :]
    first = jnp.arange(series.shape[0])[:, None] - whole.astype(int)[None, :] - 1

    def at(values: Array, index: Array) -> Array:
        rows = jnp.clip(index, 0, values.shape[0] - 1)[:, None, :]
        return jnp.take_along_axis(values, rows, axis=0)

    inside = ((first >= 0) & (first < series.shape[0] - 1))[:, None, :]
    begin, end = (jnp.where(inside, at(one, first), 0.0) for one in rates)
    left, right, rest = at(series, first), at(series, first + 1), 1.0 - u
    straight = rest**2 * (1.0 + 2.0 * u) * left + u**2 * (3.0 - 2.0 * u) * right
    return straight + u * rest * (rest * begin - u * end)
