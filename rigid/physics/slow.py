"""Slow records of steady rigs: long exponential steps where all is smooth, short ones elsewhere.

A record is led on in blocks of some samples. A block is one step where the valve is at rest, the
rig no longer rings and the pump's flow does not bend; else every sample is a step. Which it is
follows from the records for the valve, from the walkers of a batch together for the rest. The oil
column changes slowly: f takes its value in the middle of a step, and Phi is interpolated.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.delay import InMotion, Look, in_motion, looks, on_record, over_step, read, sums
from rigid.physics.drive import STRIDE, Drives, Plan, plan
from rigid.physics.rest import rest_under
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.stage_switch import STEEP, bends, flow_at, mean_excess, mean_straight
from rigid.physics.step_tables import FINER, PARTS, Tables, bulge, polynomial, tables
from rigid.physics.stroke_range import Strokes, foreseen

SMOOTH = (1.0, 5e-7, 100.0)
"""Load [N], stroke [m] and pressure [Pa], some hundredths of a tenth of the sensors' steps: a rig
rings as long as it moves by more within a block than a cubic through the ends."""


FINE, PART, SAMPLE, LONG = range(4)
"""Lengths of steps: of a part of a part of a sample, of a part, of a sample, of a block."""


class _Way(NamedTuple):
    """What does not change along the records of a group.

    - `looks`: what is not read at its instant.
    """

    rig: Rig
    looks: tuple[Look, ...]
    contact: Array
    fractions: Array
    strokes: Strokes
    table: Tables
    kink_part: Array
    kink_rest: Array
    interval: float

    def outside(self, level: Array, time: Array) -> Surroundings:
        """Frame, and flow of a level (tracks,), at a time [s]."""
        track = jnp.arange(self.fractions.shape[1])
        return Surroundings(self.contact, 0.0, self.fractions[level, track], time)

    def stroke(self, flat: Array, length: float | Array) -> Array:
        """Stroke [m] in the middle of a step of `length` [s]."""
        return flat[2] - flat[0] + 0.5 * length * (flat[3] - flat[1])

    def rates(self, flat: Array, outside: Surroundings, column: Array) -> Array:
        """Rates of a flat state with the oil column frozen."""
        moved = self.rig.motion(flat, outside, column).rates
        return jnp.stack([jnp.broadcast_to(r, flat.shape[1:]) for r in moved])

    def place(self, stroke: Array) -> Array:
        """Place of a stroke between the nodes of the table."""
        return jnp.clip(self.strokes.place(self.rig.column, stroke), -0.5, 1.5)


class _Part(NamedTuple):
    """What the drives do in a step, (tracks,) each, and when it begins [s].

    - `fresh`: whether a valve has just moved.
    """

    level: Array
    kink: Array
    after: Array
    begin: Array
    fresh: Array


def march(
    rig: Rig,
    contact: Array,
    fractions: Array,
    drives: Drives,
) -> dict[str, Array]:
    """Simulate a group of slow records from rest.

    - `rig`: parameters of shape (walkers,). - `contact` (walkers,) [N/m]: stiffness of the frame.
    - `fractions` (levels, tracks, walkers): flow fractions; level 0 is the shut valve.
    - `drives`: of the group.

    Returns load [N], stroke [m] and pressure [Pa] on record at every sample, (samples, tracks,
    walkers).
    """
    grid, strokes = plan(drives), foreseen(rig, contact, fractions, drives)
    table = tables(rig, Surroundings(contact), grid, strokes)
    part, rest = (jnp.append(0, w) for w in grid.within(PARTS))
    late = looks(rig, grid.interval, PARTS, FINER)
    way = _Way(rig, late, contact, fractions, strokes, table, part, rest[:, None], grid.interval)

    def block(carry: tuple[Array, Array], step: tuple) -> tuple[tuple[Array, Array], Array]:
        near, parts = step

        def led(carry: tuple[Array, Array]) -> tuple[tuple[Array, Array], Array]:
            flat, rings = carry
            bends = _bends_within(way, flat, parts)

            def by_samples(flat: Array) -> tuple[Array, Array, Array]:
                return _by_samples(way, flat, parts, bends)

            def at_once(flat: Array) -> tuple[Array, Array, Array]:
                return _at_once(way, flat, parts)

            new, still, series = jax.lax.cond(near | rings | bends, by_samples, at_once, flat)
            return (new, still), series

        return grid.led(parts.begin[0], led, carry)

    flat = jnp.broadcast_to(
        rest_under(rig, 0.0, contact)[:, None], (len(rig.scales), *fractions.shape[1:])
    )
    near, parts = _blocks(grid)
    (flat, _), series = jax.lax.scan(block, (flat, jnp.asarray(False)), (near, parts))
    end = way.outside(parts.level[-1, -1], parts.begin[-1, -1] + grid.interval)
    series = series.reshape(-1, *series.shape[2:])
    out = on_record(late, series, read(rig, flat, end))
    return {name: one[: grid.samples] for name, one in out.items()}


def _blocks(grid: Plan) -> tuple[Array, _Part]:
    """Which blocks are near a switch (blocks,), and their parts (blocks, STRIDE, ...)."""
    steps = grid.samples - 1
    room = -steps % STRIDE

    def cut(series: Array, mode: str) -> Array:
        widths = ((0, room), *((0, 0),) * (series.ndim - 1))
        whole = jnp.pad(series, widths, mode=mode)
        return whole.reshape(-1, STRIDE, *series.shape[1:])

    begin = grid.interval * np.arange(steps + room)
    parts = _Part(
        cut(grid.levels, "edge"),
        cut(grid.kink, "constant"),
        cut(grid.after, "edge"),
        jnp.asarray(begin.reshape(-1, STRIDE)),
        cut(grid.fresh, "constant"),
    )
    return jnp.any(cut(grid.near, "constant"), axis=1), parts


def _bends_within(way: _Way, flat: Array, parts: _Part) -> Array:
    """Whether the pump's flow bends in a block for any walker, under any flow that it has."""
    length = STRIDE * way.interval
    outside = way.outside(jnp.stack([parts.level[0], parts.level[-1]]), parts.begin[0])
    column = way.rig.column + flat[2] - flat[0]
    both = jnp.broadcast_to(flat[:, None], (len(flat), 2, *flat.shape[1:]))
    rate = way.rig.motion(both, outside, column).rates[4]
    return bends(flow_at(way.rig, both, outside, column), flat[4], rate, length)


def _led(
    way: _Way, flat: Array, rates: Array, stroke: Array, length: int | Array
) -> tuple[Array, Array]:
    """Lead a flat state on by one step; return also what a unit rate of pressure does in it.

    - `length`: of the step, FINE, PART, SAMPLE or LONG; an array holds one of the first two.
    """
    place = way.place(stroke)
    powers = way.table.powers[:, length, :, :, None]
    own = way.table.own[length] if isinstance(length, Array) or length < LONG else None
    off = bulge(place)
    new, columns = flat, []
    for j in range(flat.shape[0]):
        column = polynomial(powers[:, :, j], place)
        if own is not None:
            column = column + off * own[:, j]
        columns.append(column)
        new = new + column * rates[j]
    return new, columns[4]


def _straight(way: _Way, flat: Array, outside: Surroundings, stroke: Array, length: int) -> Array:
    """Lead a flat state on by a step in which the flow hardly bends.

    A state at rest in the bend does not move, but a step longer than the flow takes to answer would
    drive it off, and its slopes with it: so the flow follows the pressure, on the mean of the step.
    """
    column = way.rig.column + stroke
    new, kept = _led(way, flat, way.rates(flat, outside, column), stroke, length)
    more = mean_straight(flow_at(way.rig, flat, outside, column), flat[4], new[4], kept[4])
    return new + kept * more


def _between(way: _Way, first: InMotion, last: InMotion) -> Array:
    """Cubic through readings at the ends of a block, (STRIDE, 3, tracks, walkers).

    Its derivative is that of the chord. A ring too small to be read, 0.02 N at 240 Hz, bows the
    cubic by a newton; its phase turns by hundreds of radians a prior sd of a stiffness, and so
    would the bow, which no record shows.
    """
    u = (jnp.arange(STRIDE) / STRIDE).reshape(-1, 1, 1, 1)
    h = STRIDE * way.interval
    w1, s0, s1 = u**2 * (3 - 2 * u), u * (1 - u) ** 2 * h, u**2 * (u - 1) * h
    chord = last[0] - first[0]
    bow = (w1 - u) * chord + s0 * first[1] + s1 * last[1]
    return first[0] + u * chord + jax.lax.stop_gradient(bow)


def _rates_between(way: _Way, first: InMotion, last: InMotion, ends: bool) -> Array:
    """Rates of change of the cubic of `_between`, (STRIDE, 3, tracks, walkers).

    - `ends`: where steps between samples end, not where they begin.
    """
    u = ((jnp.arange(STRIDE) + ends) / STRIDE).reshape(-1, 1, 1, 1)
    steady = (last[0] - first[0]) / (STRIDE * way.interval)
    more = (1 - u) * (1 - 3 * u) * (first[1] - steady) + u * (3 * u - 2) * (last[1] - steady)
    return steady + jax.lax.stop_gradient(more)


def _at_once(way: _Way, flat: Array, parts: _Part) -> tuple[Array, Array, Array]:
    """One step over a block: its end, that nothing rings, and readings at its samples."""
    length = STRIDE * way.interval
    outside = way.outside(parts.level[0], parts.begin[0] + 0.5 * length)
    new = _straight(way, flat, outside, way.stroke(flat, length), LONG)
    ends = in_motion(way.rig, (flat, outside), (new, outside))
    series = _between(way, *ends)
    if way.looks:
        after = jnp.concatenate([series[1:], ends[1].values[None]])
        first, last = (_rates_between(way, *ends, end) for end in (False, True))
        more = sums(way.looks, InMotion(series, first), InMotion(after, last))
        series = jnp.concatenate([series, more], axis=1)
    return new, jnp.asarray(False), series


def _by_samples(way: _Way, flat: Array, parts: _Part, bends: Array) -> tuple[Array, Array, Array]:
    """Lead a block on sample by sample: its end, whether any rig rings in it, and readings."""

    def one(flat: Array, part: _Part) -> tuple[Array, Array]:
        outside = way.outside(part.level, part.begin + 0.5 * way.interval)
        new, more = _sample(way, flat, part, bends)
        return new, jnp.concatenate([read(way.rig, flat, outside), more])

    new, series = jax.lax.scan(one, flat, parts)
    begin = way.outside(parts.level[0], parts.begin[0])
    end = way.outside(parts.level[-1], parts.begin[-1] + way.interval)
    ends = in_motion(way.rig, (flat, begin), (new, end))
    off = jnp.abs(series[:, : len(SMOOTH)] - _between(way, *ends))
    return new, jnp.any(off > jnp.asarray(SMOOTH)[:, None, None]), series


def _sample(way: _Way, flat: Array, part: _Part, bends: Array) -> tuple[Array, Array]:
    """Lead a flat state on by a sample, and give what it adds to readings on record.

    At once, or in parts where the flow changes within it, or has just changed and what is read is
    not that of an instant.
    """

    def whole(flat: Array) -> tuple[Array, Array]:
        outside = way.outside(part.level, part.begin + 0.5 * way.interval)
        new = _straight(way, flat, outside, way.stroke(flat, way.interval), SAMPLE)
        end = way.outside(part.after, part.begin + way.interval)
        return new, over_step(way.rig, way.looks, (flat, outside), (new, end))

    def cut(flat: Array) -> tuple[Array, Array]:
        switched = way.kink_part[part.kink]

        def one(flat: Array, number: Array) -> tuple[Array, Array]:
            over = (part.kink > 0) & (number > switched)
            level = jnp.where(over, part.after, part.level)
            kink = jnp.where(number == switched, part.kink, 0)
            begin = part.begin + number * way.interval / PARTS
            now = _Part(level, kink, part.after, begin, part.fresh)
            fine = bends & _steep(way, flat, now) & ~jnp.any(kink > 0)
            new = _part_of_sample(way, flat, now, fine)
            left = jnp.where(kink > 0, part.after, level)
            ends = (flat, way.outside(level, begin)), (new, way.outside(left, begin))
            return new, over_step(way.rig, way.looks, *ends, part=number)

        new, more = jax.lax.scan(one, flat, jnp.arange(PARTS))
        return new, more.sum(axis=0)

    def smooth(flat: Array) -> tuple[Array, Array]:
        new, more = whole(flat)
        if way.looks:
            # The rig moves as it does where all is read at its instant.
            graded = partial(_in_graded_steps, way)
            more = jax.lax.cond(part.fresh, graded, lambda *_: more, flat, part)
        return new, more

    return jax.lax.cond(bends | jnp.any(part.kink > 0), cut, smooth, flat)


def _in_graded_steps(way: _Way, flat: Array, part: _Part) -> Array:
    """What a sample in which nothing switches adds to readings on record, just after a switch.

    Its first part goes by fine steps, for sensors and oil may settle within it.
    """
    h = way.interval / PARTS

    def led(flat: Array, step: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        number, length, since = step
        begin, seconds = part.begin + since, jnp.where(length == FINE, h / FINER, h)
        new = _bent(way, flat, part._replace(begin=begin), length, seconds)
        outside = way.outside(part.level, begin)
        return new, over_step(way.rig, way.looks, (flat, outside), (new, outside), number, True)

    lengths = np.array([FINE] * FINER + [PART] * (PARTS - 1))
    since = np.append(np.arange(FINER) / FINER, np.arange(1, PARTS)) * h
    steps = jnp.arange(len(lengths)), jnp.asarray(lengths), jnp.asarray(since)
    return jax.lax.scan(led, flat, steps)[1].sum(axis=0)


def _steep(way: _Way, flat: Array, part: _Part) -> Array:
    """Whether the pressure of any walker passes much of the bend in a part of a sample."""
    h = way.interval / PARTS
    outside = way.outside(part.level, part.begin + 0.5 * h)
    column = way.rig.column + way.stroke(flat, h)
    rate = way.rates(flat, outside, column)[4]
    return bends(flow_at(way.rig, flat, outside, column), flat[4], rate, h, STEEP)


def _part_of_sample(way: _Way, flat: Array, part: _Part, fine: Array) -> Array:
    """Lead a flat state on by a part of a sample, in which the valve may move.

    - `fine`: whether it is cut once more; then the valve rests.
    """
    h = way.interval / PARTS
    length, seconds = jnp.where(fine, FINE, PART), jnp.where(fine, h / FINER, h)

    def one(flat: Array, number: Array) -> tuple[Array, None]:
        def led(flat: Array) -> Array:
            now = part._replace(begin=part.begin + number * seconds)
            return _bent(way, flat, now, length, seconds)

        # A loop that ends where it is done would have no gradient in reverse mode.
        return jax.lax.cond(fine | (number == 0), led, lambda flat: flat, flat), None

    new = jax.lax.scan(one, flat, jnp.arange(FINER))[0]
    column = way.rig.column + way.stroke(flat, h)
    before, after = (
        flow_at(way.rig, flat, way.outside(level, part.begin + 0.5 * h), column)
        for level in (part.level, part.after)
    )
    kick = jnp.moveaxis(way.table.kinks[part.kink], 0, 1)  # none where the valve rests
    gained, left = new[4] - flat[4], way.kink_rest[part.kink] / h
    then, middle = flat[4] + (1.0 - left) * gained, flat[4] + (1.0 - 0.5 * left) * gained
    jump = after(then) - before(middle)
    # The flow after the switch is that at the pressure halfway to the end of the step.
    return new + kick * (after(0.5 * (then + new[4] + kick[4] * jump)) - before(middle))


def _bent(way: _Way, flat: Array, part: _Part, length: Array, seconds: Array) -> Array:
    """Lead a flat state on by a step in which the flow may bend."""
    outside = way.outside(part.level, part.begin + 0.5 * seconds)
    stroke = way.stroke(flat, seconds)
    column = way.rig.column + stroke
    new, kept = _led(way, flat, way.rates(flat, outside, column), stroke, length)
    flow = flow_at(way.rig, flat, outside, column)
    return new + kept * mean_excess(flow, flat[4], new[4], kept[4])
