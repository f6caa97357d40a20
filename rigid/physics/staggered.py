"""Short exponential steps: for rigs whose Jacobian changes, with dry friction, air, a contact.

A step is y + Phi(h) (f(m) - A (m - y)) with m = y + Phi(h/2) f(y), the exponential midpoint rule.
A is the Jacobian of the rig at work (under pressure, in contact), where it is stiffest, so that Phi
is made once a record; what an effect does beyond that is smooth over a part of a sample. Bristles
are stiff in a way of their own, at a rate that goes with the speed: they live half a step beside
the rest and relax exactly at the speed of the moment, so that neither a sliding nor a sticking
plunger limits the step. Second order in h.
Source: Hochbruck and Ostermann 2010, Acta Numerica 19, sec. 2.3; staggering after Stoermer-Verlet,
Hairer, Lubich and Wanner 2003, Acta Numerica 12, 399-450.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect
from rigid.physics.delay import looks, on_record, over_step, read
from rigid.physics.drive import Drives, Plan, plan
from rigid.physics.release import NODE
from rigid.physics.rest import rest_under
from rigid.physics.rig import CORE_SCALES, FREE, Rig, Surroundings
from rigid.physics.step_matrices import apply, mean_growth, step_matrix
from rigid.physics.stroke_range import Strokes, foreseen

SUBSTEPS, WITH_BRISTLES, RELEASE_SUBSTEPS = 16, 24, 4
"""Steps a sample of slow records, without and with dry friction, and of releases: 0.6, 0.4 and
0.16 ms, where the fastest mode of the rig has 4 ms."""

PARTS = 4
"""Parts of a sample between which readings lie that are not those of an instant."""

AT_WORK = (-1e-3, 0.0, 1e-3, 0.0, 136e5)
"""State at which the Jacobian is taken [m, m/s, m, m/s, Pa]: 60 kN, in contact."""


def steps_a_sample(effects: Iterable[AbstractEffect | type[AbstractEffect]]) -> int:
    """Return into how many steps a sample of slow records is cut."""
    return WITH_BRISTLES if any(effect.bristle for effect in effects) else SUBSTEPS


def at_work(rig: Rig, outside: Surroundings, column: Array) -> Array:
    """Jacobian (n, n, *column.shape) of the rig at work, without what stiff bristles do."""
    n = len(rig.scales)
    shape = jnp.broadcast_shapes(column.shape, rig.column.shape)
    core = jnp.stack([jnp.full(shape, v) for v in AT_WORK])
    state = jnp.concatenate([core, jnp.zeros((n - len(AT_WORK), *shape))])

    def rates(flat: Array) -> Array:
        moved = rig.motion(flat, outside, column).rates
        return jnp.stack([jnp.broadcast_to(r, shape) for r in moved])

    def along(i: Array) -> Array:
        return jax.jvp(rates, (state,), (jnp.zeros_like(state).at[i].set(1.0),))[1]

    matrix = jnp.moveaxis(jax.vmap(along)(jnp.arange(n)), 0, 1)
    kept = jnp.asarray([i not in stiff_states(rig) for i in range(n)]).astype(float)
    mask = (kept[:, None] * kept[None]).reshape((n, n) + (1,) * len(shape))
    return matrix * mask


def stiff_states(rig: Rig) -> tuple[int, ...]:
    """Places of bristles in the flat state."""
    found, at = [], len(CORE_SCALES)
    for effect in rig.effects:
        if effect.bristle:
            found.extend(range(at, at + len(effect.scales)))
        at += len(effect.scales)
    return tuple(found)


def relaxed(rig: Rig, flat: Array, length: Array | float) -> Array:
    """Lead the bristles of a flat state on by `length` [s] at the speed of the moment."""
    state, at = rig.state(flat), len(CORE_SCALES)
    for effect, own in zip(rig.effects, rig.own(flat), strict=True):
        if effect.bristle:

            def rate(share: Array, effect=effect) -> Array:
                return effect(state, (share,)).rates[0]

            now, slope = jax.jvp(rate, (own[0],), (jnp.ones_like(own[0]),))
            flat = flat.at[at].add(length * mean_growth(slope * length) * now)
        at += len(effect.scales)
    return flat


def march(
    rig: Rig, contact: Array, fractions: Array, drives: Drives, angles: Array
) -> dict[str, Array]:
    """Simulate a group of slow records from rest; arguments and result as `slow.march`.

    - `angles` (tracks, walkers) [rad]: of the pump when a record begins.
    """
    parts = steps_a_sample(rig.effects)
    grid = plan(drives.finer(parts))
    strokes = foreseen(rig, contact, fractions, drives)
    advance = _advancer(rig, contact, (fractions, angles), grid, strokes)
    track = jnp.arange(fractions.shape[1])

    late = looks(rig, drives.interval, PARTS)
    pieces = PARTS if late else 1

    def piece(flat: Array, part: tuple[Array, tuple[Array, ...]]) -> tuple[Array, Array]:
        number, steps = part
        levels, _, after, begins = steps
        here = Surroundings(contact, 0.0, fractions[levels[0], track], begins[0], angles)
        new = jax.lax.scan(advance, flat, steps)[0]
        end = begins[-1] + grid.interval
        there = here._replace(flow_fraction=fractions[after[-1], track], time=end)
        return new, over_step(rig, late, (flat, here), (new, there), part=number)

    def sample(flat: Array, part: tuple[Array, ...]) -> tuple[Array, Array]:
        levels, *_, begins = part
        here = Surroundings(contact, 0.0, fractions[levels[0, 0], track], begins[0, 0], angles)
        new, more = jax.lax.scan(piece, flat, (jnp.arange(pieces), part))
        return new, jnp.concatenate([read(rig, flat, here), more.sum(axis=0)])

    begin = jnp.arange(grid.samples - 1) * grid.interval
    cut = tuple(
        a.reshape(-1, pieces, parts // pieces, *a.shape[1:])
        for a in (grid.levels, grid.kink, grid.after, begin)
    )
    shape = (len(rig.scales), *fractions.shape[1:])
    start = jnp.broadcast_to(rest_under(rig, 0.0, contact)[:, None], shape)
    last, series = jax.lax.scan(sample, start, cut)
    flows, length = fractions[grid.levels[-1], track], (grid.samples - 1) * grid.interval
    end = Surroundings(contact, 0.0, flows, length, angles)
    return on_record(late, series, read(rig, last, end))


class Table(NamedTuple):
    """A, Phi(h) and Phi(h/2) of one rig at the lower stroke, and their change to the higher.

    (n, n, ...) each. A goes along with the oil column as Phi does: with one A for all of a record,
    errors are of first order in h.
    """

    matrix: tuple[Array, Array]
    whole: tuple[Array, Array]
    half: tuple[Array, Array]


def _pair(matrix: Array, length: Array | float, rig: Rig) -> Table:
    """Tables for matrices (n, n, 2, ...) at two strokes."""
    whole = step_matrix(matrix, length, rig.scales)
    half = step_matrix(matrix, 0.5 * jnp.asarray(length), rig.scales)
    return Table(
        (matrix[:, :, 0], matrix[:, :, 1] - matrix[:, :, 0]),
        (whole[:, :, 0], whole[:, :, 1] - whole[:, :, 0]),
        (half[:, :, 0], half[:, :, 1] - half[:, :, 0]),
    )


def _midpoint(flat: Array, rates: Callable, table: Table, place: Array) -> Array:
    """One step of the exponential midpoint rule; bristles have been led on already.

    - `rates`: of a flat state. - `place`: of the oil column between the two of the table.
    """
    first = rates(flat)
    middle = flat + _between(table.half, place, first)
    moved = rates(middle) - _between(table.matrix, place, middle - flat)
    return flat + _between(table.whole, place, moved)


def _between(pair: tuple[Array, Array], place: Array, vector: Array) -> Array:
    """Matrix times vector, the matrix interpolated between two."""
    return apply(pair[0], vector) + place * apply(pair[1], vector)


def _advancer(
    rig: Rig, contact: Array, pump: tuple[Array, Array], grid: Plan, strokes: Strokes
) -> Callable:
    """Return the step of `march`; `pump`: fractions and angles."""
    fractions, angles = pump
    track, h = jnp.arange(fractions.shape[1]), grid.interval
    at_switch = strokes.switch[grid.kink_place[:, 0], grid.kink_place[:, 1]]
    extra = jnp.concatenate([jnp.stack([strokes.low, strokes.high]), at_switch])
    matrix = at_work(rig, Surroundings(contact), rig.column + extra)
    table = jax.tree.map(lambda a: a[:, :, None], _pair(matrix[:, :, :2], h, rig))
    rest = grid.kink_rest[:, None]
    none = jnp.zeros((1, len(rig.scales), matrix.shape[-1]))
    after = step_matrix(matrix[:, :, 2:], rest, rig.scales)[:, 4]
    kinks = jnp.concatenate([none, jnp.moveaxis(after, 1, 0)])

    def advance(flat: Array, part: tuple[Array, ...]) -> tuple[Array, None]:
        level, kink, level_after, begin = part
        flat = relaxed(rig, flat, h)
        stroke = flat[2] - flat[0] + 0.5 * h * (flat[3] - flat[1])
        outside = Surroundings(contact, 0.0, fractions[level, track], begin + 0.5 * h, angles)
        place = jnp.clip(strokes.place(rig.column, stroke), -0.5, 1.5)

        def rates(flat: Array, outside: Surroundings = outside) -> Array:
            return _rates(rig, flat, outside, rig.column + stroke)

        new = _midpoint(flat, rates, table, place)

        def kicked(new: Array) -> Array:
            changed = outside._replace(flow_fraction=fractions[level_after, track])
            jump = rates(flat, changed)[4] - rates(flat)[4]
            return new + jnp.moveaxis(kinks[kink], 0, 1) * jump

        return jax.lax.cond(jnp.any(kink > 0), kicked, lambda new: new, new), None

    return advance


def _rates(rig: Rig, flat: Array, outside: Surroundings, column: Array) -> Array:
    """Rates of a flat state, 0 for the bristles, which have been led on already."""
    moved = rig.motion(flat, outside, column).rates
    stiff = stiff_states(rig)
    return jnp.stack(
        [
            jnp.zeros(flat.shape[1:]) if i in stiff else jnp.broadcast_to(r, flat.shape[1:])
            for i, r in enumerate(moved)
        ]
    )


def ring(rig: Rig, preload: Array, delay: Array, interval: float, samples: int) -> Array:
    """Acceleration of the plate after a release; arguments and result as `release.ring`."""
    columns = rig.column + jnp.asarray([0.0, NODE])[:, None]
    matrix = at_work(rig, FREE, columns)[:, :, :, None]
    h, first = interval / RELEASE_SUBSTEPS, delay / RELEASE_SUBSTEPS
    tables = (_pair(matrix, h, rig), _pair(matrix, first, rig))

    def step(flat: Array, table: Table, lengths: tuple, at: Array | float) -> Array:
        before, length = lengths  # bristles live in the middle of steps
        flat = relaxed(rig, flat, 0.5 * (before + length))
        stroke = flat[2] - flat[0] + 0.5 * length * (flat[3] - flat[1])
        outside = FREE._replace(time=at + 0.5 * length)

        def rates(flat: Array) -> Array:
            return _rates(rig, flat, outside, rig.column + stroke)

        return _midpoint(flat, rates, table, stroke / NODE)

    def advance(flat: Array, number: Array) -> tuple[Array, Array]:
        time = delay + number * interval
        before = jnp.where(number == 0, first, h)
        level = relaxed(rig, flat, 0.5 * before)
        read = rig.motion(level, FREE._replace(time=time)).plunger_acceleration
        for i in range(RELEASE_SUBSTEPS):
            flat = step(flat, tables[0], (h if i else before, h), time + i * h)
        return flat, read

    flat = rest_under(rig, preload)
    for i in range(RELEASE_SUBSTEPS):
        flat = step(flat, tables[1], (first if i else 0.0, first), i * first)
    return jax.lax.scan(advance, flat, jnp.arange(samples))[1]
