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
from jax.typing import ArrayLike

from rigid.physics.drive import EDGE
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import readings, readings_of

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
    lags, mean = rig.delays(), rig.averaging()
    seen = [place for place, q in enumerate(READ) if q in lags or mean is not None]
    if not seen:
        return ()
    equal = np.arange(parts + 1) / parts
    graded = np.append(np.arange(finer) / (finer * parts), equal[1:])
    ways = np.array([0.0, 1.0]), equal, graded
    back = (0, 1) if mean is None else (0, 1, 2)
    given = [lags.get(READ[place], jnp.zeros(1)) for place in seen]
    _, *given = jnp.broadcast_arrays(jnp.zeros(1) if mean is None else mean[0], *given)
    # All in one table, quantities side by side: a table each would take long to compile.
    lag = jnp.concatenate(given) / interval
    whole = jnp.floor(lag)
    if mean is not None:
        share, width = (jnp.broadcast_to(one, given[0].shape) for one in mean)
        mean = jnp.tile(share, len(seen)), jnp.tile(width, len(seen))
    table = _weights(lag - whole, mean, back, interval, ways)
    counts = np.cumsum([len(edges) - 1 for edges in ways])[:-1]
    own = zip(seen, jnp.split(whole, len(seen)), jnp.split(table, len(seen), axis=-1), strict=True)
    return tuple(
        Look(place, back, first.astype(int), *jnp.split(mine, counts, axis=1))
        for place, first, mine in own
    )


def _weights(
    late: Array,
    mean: tuple[Array, Array] | None,
    back: Sequence[int],
    interval: float,
    ways: Sequence[np.ndarray],
) -> Array:
    """Weights (back, parts, 4, walkers) of values and rates, in the parts of one way after another.

    What is on time is read where the next interval begins: there a valve has moved that moves then.

    - `late` (walkers,): fraction of an interval. - `mean`: share that is one, and over what part of
      an interval. - `ways`: to cut one; edges of the parts, from 0 to 1, of each.
    """
    at = np.concatenate([edges[:-1] for edges in ways])[:, None]
    length = np.concatenate([np.diff(edges) for edges in ways])[:, None]
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


class InMotion(NamedTuple):
    """Readings (..., 3, tracks, walkers) and how fast they change."""

    values: Array
    rates: Array


def in_motion(
    rig: Rig, begin: tuple[Array, Surroundings], end: tuple[Array, Surroundings]
) -> tuple[InMotion, InMotion]:
    """Readings of two flat states, (3, tracks, walkers) each, and how fast they change.

    Both in one call: the equations of motion are what takes long to compile.
    """
    outside = jax.tree.map(_beside, begin[1], end[1])
    flat = jnp.stack([begin[0], end[0]], axis=1)

    def at(flat: Array) -> tuple[Array, Array]:
        motion = rig.motion(flat, outside)
        return _alike(readings_of(motion, flat)[:3], flat), _alike(motion.rates, flat)

    (values, rates), along = jax.linearize(at, flat)
    moving, _ = along(rates)
    return InMotion(values[:, 0], moving[:, 0]), InMotion(values[:, 1], moving[:, 1])


def _beside(first: ArrayLike, last: ArrayLike) -> Array:
    """Two surroundings' parts, () or up to (tracks, walkers) each, as (2, tracks, walkers)."""
    both = jnp.stack(jnp.broadcast_arrays(jnp.asarray(first), jnp.asarray(last)))
    return both.reshape(2, *[1] * (3 - both.ndim), *both.shape[1:])


def _alike(rows: Sequence[ArrayLike], flat: Array) -> Array:
    """Rows that broadcast over a flat state, one beneath the other."""
    return jnp.stack([jnp.broadcast_to(row, flat.shape[1:]) for row in rows])


def read(rig: Rig, flat: Array, outside: Surroundings) -> Array:
    """Readings (3, ...) of a flat state."""
    return _alike(readings(rig, flat, outside)[:3], flat)


def sums(
    found: Sequence[Look],
    begin: InMotion,
    end: InMotion,
    part: Array | None = None,
    graded: bool = False,
) -> Array:
    """What an interval, or a part of it, adds to readings on record: (..., rows, tracks, walkers).

    - `begin`, `end`: readings and their rates where it begins and ends.
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
    return sums(found, *in_motion(rig, begin, end), part, graded)


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
