"""Readings of what was there before, or of a mean about it: late time stamps, slow converters.

Between two samples lies the cubic through both and their rates of change, each as it is within that
interval. A cubic through neighbours alone would spread a jump of the pressure, where the valve
switches, over the samples beside it, though a delay of half a millisecond moves none of them there.
Just after a switch, where a rig or a lagging sensor answers within a few milliseconds, there are
such cubics in each of some parts of an interval.

What stands on record is a weighted sum of what such cubics go through. The weights follow from
delay and mean before a simulation, so that a step keeps the sums alone.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.drive import EDGE
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import readings

READ = ("load", "stroke", "pressure")
"""What is read of slow records."""


class Look(NamedTuple):
    """Of what one quantity's readings on record are made.

    - `place`: in READ. - `back`: numbers of the intervals that make a reading, 0 the one that
      begins `whole` (walkers,) samples before it, 1 the one before that.
    - `once` (back, 1, 4, walkers): weights of the values where an interval begins and ends, and of
      the rates [1/s] there. - `cut`, `graded` (back, parts, 4, walkers): the same in equal parts of
      an interval, and in parts the first of which is cut once more.
    """

    place: int
    back: tuple[int, ...]
    whole: Array
    once: Array
    cut: Array
    graded: Array


def looks(rig: Rig, interval: float, parts: int, finer: int = 1) -> tuple[Look, ...]:
    """Return what is not read at its instant.

    - `parts`: into which some intervals are cut, `finer`: into which the first is cut once more.
    """
    equal = np.arange(parts + 1) / parts
    graded = np.append(np.arange(finer) / (finer * parts), equal[1:])
    lags, mean, found = rig.delays(), rig.averaging(), []
    for place, quantity in enumerate(READ):
        if quantity not in lags and mean is None:
            continue
        lag = lags.get(quantity, jnp.zeros(1)) / interval
        whole = jnp.floor(lag)
        back = (0, 1) if mean is None else (0, 1, 2)
        weights = (
            _weights(lag - whole, mean, back, interval, edges)
            for edges in (np.array([0.0, 1.0]), equal, graded)
        )
        found.append(Look(place, back, whole.astype(int), *weights))
    return tuple(found)


def _weights(
    late: Array,
    mean: tuple[Array, Array] | None,
    back: Sequence[int],
    interval: float,
    edges: np.ndarray,
) -> Array:
    """Weights (back, parts, 4, walkers) of values and rates.

    What is on time is read where the next interval begins: there a valve has moved that moves then.

    - `late` (walkers,): fraction of an interval. - `mean`: share that is one, and over what part of
      an interval. - `edges` (parts + 1,): of the parts, from 0 to 1.
    """
    at, length = edges[:-1, None], np.diff(edges)[:, None]
    one = np.ones_like(length)
    units = np.stack([one, one, interval * length, interval * length], axis=1)

    def within(x: Array) -> Array:
        return jnp.clip((x - at) / length, 0.0, 1.0)

    place = jnp.maximum(1.0 - late, EDGE)
    here = (late > 0.0) & (place > at) & (place <= at + length)
    before = jnp.where(here[:, None], _through(within(1.0 - late)), 0.0)
    on_time = jnp.where(((late == 0.0) & (at == 0))[:, None], _through(0.0 * late + 0.0 * at), 0.0)
    points = [on_time, before, jnp.zeros_like(before)]
    if mean is None:
        return jnp.stack(points[: len(back)]) * units
    share, width = mean
    rows = []
    for number in back:
        ends = (jnp.clip(number - late + 0.5 * s * width, 0.0, 1.0) for s in (-1.0, 1.0))
        low, high = (_under(within(x)) for x in ends)
        mass = length[:, None] * (high - low) / width
        rows.append(share * mass + (1.0 - share) * points[number])
    return jnp.stack(rows) * units


def _through(v: Array) -> Array:
    """What values and rates at 0 and 1 add to their cubic at v: (parts, 4, walkers)."""
    rest = 1.0 - v
    first, last = rest**2 * (1.0 + 2.0 * v), v**2 * (1.0 + 2.0 * rest)
    return jnp.stack([first, last, v * rest**2, -rest * v**2], axis=1)


def _under(v: Array) -> Array:
    """What they add to the integral of it from 0 to v."""
    first, last = v - v**3 + 0.5 * v**4, v**3 - 0.5 * v**4
    begin, end = v**2 / 2.0 - 2.0 * v**3 / 3.0 + v**4 / 4.0, v**4 / 4.0 - v**3 / 3.0
    return jnp.stack([first, last, begin, end], axis=1)


def in_motion(rig: Rig, flat: Array, outside: Surroundings) -> tuple[Array, Array]:
    """Readings (3, ...) of a flat state and how fast they change."""
    shape = flat.shape[1:]
    rates = rig.motion(flat, outside).rates
    along = jnp.stack([jnp.broadcast_to(r, shape) for r in rates])
    return jax.jvp(lambda y: read(rig, y, outside), (flat,), (along,))


def read(rig: Rig, flat: Array, outside: Surroundings) -> Array:
    """Readings (3, ...) of a flat state."""
    shape = flat.shape[1:]
    return jnp.stack([jnp.broadcast_to(r, shape) for r in readings(rig, flat, outside)[:3]])


def sums(
    found: Sequence[Look],
    begin: tuple[Array, Array],
    end: tuple[Array, Array],
    part: Array | None = None,
    graded: bool = False,
) -> Array:
    """What an interval, or a part of it, adds to readings on record: (..., rows, tracks, walkers).

    - `begin`, `end`: readings (..., 3, tracks, walkers) and their rates where it begins and ends.
    - `part`: its number, among the `graded` ones or the equal ones; None: all of the interval.
    """
    rows = []
    for look in found:
        four = [one[..., look.place, :, :] for one in (begin[0], end[0], begin[1], end[1])]
        parts = look.graded if graded else look.cut
        for row in look.once[:, 0] if part is None else parts[:, part]:
            rows.append(sum(weight * one for weight, one in zip(row, four, strict=True)))
    if not rows:
        return begin[0][..., :0, :, :]
    return jnp.stack(rows, axis=-3)


def over_step(
    rig: Rig,
    found: Sequence[Look],
    begin: tuple[Array, Surroundings],
    end: tuple[Array, Surroundings],
    part: Array | None = None,
    graded: bool = False,
) -> Array:
    """What a step adds to readings on record, as `sums`.

    - `begin`, `end`: flat states and surroundings there.
    """
    if not found:
        return begin[0][:0]
    return sums(found, in_motion(rig, *begin), in_motion(rig, *end), part, graded)


def on_record(found: Sequence[Look], series: Array, last: Array) -> dict[str, Array]:
    """What stands on record (samples, tracks, walkers), by quantity.

    - `series` (samples - 1, 3 + rows, tracks, walkers): readings where each interval begins,
      beneath them what it adds to readings on record. - `last` (3, tracks, walkers): at the end.

    Before the first sample and after the last all stands still.
    """
    out = {name: jnp.concatenate([series[:, i], last[None, i]]) for i, name in enumerate(READ)}
    at = len(READ)
    for look in found:
        still = out[READ[look.place]]
        total = jnp.zeros_like(still)
        for number, weights in zip(look.back, look.once, strict=True):
            steady = (weights[0, 0] + weights[0, 1]) * still[jnp.asarray([0, -1])]
            rows = jnp.concatenate([steady[:1], series[:, at], steady[1:]])
            interval = jnp.arange(len(still))[:, None] - look.whole - number
            place = jnp.clip(interval + 1, 0, len(rows) - 1)[:, None, :]
            total, at = total + jnp.take_along_axis(rows, place, axis=0), at + 1
        out[READ[look.place]] = total
    return out
