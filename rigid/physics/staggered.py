"""Short exponential steps: for rigs whose Jacobian changes, with dry friction, air, a contact.

A step is y + Phi(h) (f(m) - A (m - y)) with m = y + Phi(h/2) f(y), the exponential midpoint rule.
A is the Jacobian of the rig at work (under pressure, in contact), where it is stiffest, so that Phi
is made once a record; what an effect does beyond that is smooth over a part of a sample. Oil with
air in it is tens of times softer at rest: there A goes with the stiffness of the oil. Bristles
are stiff in ways of their own: they relax at a rate that goes with the speed, and what they hold
is a spring beside the rig's. A step is implicit in them alone (`rubbing`): neither a sliding nor a
sticking plunger limits it. Second order in h.
Sources: Hochbruck and Ostermann 2010, Acta Numerica 19, sec. 2.3; the implicit midpoint rule,
Hairer, Lubich and Wanner 2006, Geometric Numerical Integration, II.1.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect
from rigid.physics.delay import looks, on_record, over_step, read
from rigid.physics.drive import Drives, Plan, plan
from rigid.physics.oil_tables import Oil, Table, at_place, at_work, times
from rigid.physics.release import NODE
from rigid.physics.rest import rest_under
from rigid.physics.rig import CORE_SCALES, FREE, Rig, Surroundings
from rigid.physics.rubbing import Rubbing
from rigid.physics.step_matrices import step_column
from rigid.physics.stroke_range import Strokes, foreseen


class Cut(NamedTuple):
    """Into how many steps a sample of slow records is cut, and one of a release."""

    slow: int
    release: int


SMOOTH, DRY = Cut(16, 8), Cut(24, 64)
"""Without and with dry friction: steps of 0.6 and 0.4, 0.08 and 0.01 ms, where the fastest mode of
the rig has 4 ms and a plate on bristles of 0.3 um, with 2 kN, 0.4. In a release it swings there.
Without it readings are off by a hundredth of a sensor's step: 0.06 steps of a gauge moved means by
0.6 posterior sds."""

PARTS = 4
"""Parts of a sample between which readings lie that are not those of an instant."""

COARSE_SMOOTH, COARSE_DRY = Cut(8, 4), Cut(8, 16)
"""The same where it is asked what a little of an effect changes: most of the error is in both."""


def cut_of(effects: Iterable[AbstractEffect | type[AbstractEffect]], coarse: bool = False) -> Cut:
    """Return into how many steps samples of a rig with some effects are cut.

    - `coarse`: for what a little of an effect changes.
    """
    listed = tuple(effects)
    dry = any(effect.bristle for effect in listed)
    if coarse:
        return COARSE_DRY if dry else COARSE_SMOOTH
    if dry:
        return DRY
    finer = max((effect.finer for effect in listed if not effect.steady), default=1)
    return Cut(finer * SMOOTH.slow, finer * SMOOTH.release)


class Parted(NamedTuple):
    """A rig in two: what is smooth, and the bristles of its dry friction.

    - `smooth`: the rig without bristles; `kept`: where its states stand in the flat state.
    - `bristles`; `bent`: where the state of each stands.
    """

    smooth: Rig
    kept: tuple[int, ...]
    bristles: tuple[AbstractEffect, ...]
    bent: tuple[int, ...]

    @classmethod
    def of(cls, rig: Rig) -> "Parted":
        """Part a rig."""
        bristles = tuple(effect for effect in rig.effects if effect.bristle)
        others = tuple(effect for effect in rig.effects if not effect.bristle)
        bent, at = [], len(CORE_SCALES)
        for effect in rig.effects:
            bent += [at] if effect.bristle else []
            at += len(effect.scales)
        kept = tuple(i for i in range(at) if i not in bent)
        return cls(eqx.tree_at(lambda r: r.effects, rig, others), kept, bristles, tuple(bent))

    def split(self, flat: Array) -> tuple[Array, tuple[Array, ...]]:
        """Flat state of the smooth rig, and the share that each bristle carries."""
        return flat[jnp.asarray(self.kept)], tuple(flat[i] for i in self.bent)

    def joined(self, smooth: Array, shares: tuple[Array, ...]) -> Array:
        """Undo `split`."""
        rows = dict(zip(self.kept, smooth, strict=True)) | dict(zip(self.bent, shares, strict=True))
        return jnp.stack([rows[i] for i in range(len(rows))])


def march(
    rig: Rig,
    contact: Array,
    fractions: Array,
    drives: Drives,
    angles: Array,
    coarse: bool = False,
) -> dict[str, Array]:
    """Simulate a group of slow records from rest; arguments and result as `slow.march`.

    - `angles` (tracks, walkers) [rad]: of the pump when a record begins. - `coarse`: as `cut_of`.
    """
    parts = cut_of(rig.effects, coarse).slow
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

        def led(flat: Array) -> tuple[Array, Array]:
            here = Surroundings(contact, 0.0, fractions[levels[0, 0], track], begins[0, 0], angles)
            new, more = jax.lax.scan(piece, flat, (jnp.arange(pieces), part))
            return new, jnp.concatenate([read(rig, flat, here), more.sum(axis=0)])

        return grid.led(begins[0, 0], led, flat)

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


class Step(NamedTuple):
    """What a step goes by.

    - `outside`, `column` [m]: in its middle. - `length` [s].
    - `table`: step matrices of the smooth rig. - `place`: of the oil in it.
    """

    outside: Surroundings
    column: Array
    length: Array | float
    table: Table
    place: Array


def _midpoint(parted: Parted, flat: Array, step: Step) -> Array:
    """One step of the exponential midpoint rule, implicit in what bristles do."""
    rig = parted.smooth
    start, shares = parted.split(flat)

    def rates(smooth: Array, outside: Surroundings) -> Array:
        moved = rig.motion(smooth, outside, step.column).rates
        return jnp.stack([jnp.broadcast_to(r, smooth.shape[1:]) for r in moved])

    begun = rates(start, step.outside)
    middle = start + times(step.table.half, step.place, begun)
    outside = step.outside
    if shares:
        free = _slid(times(step.table.whole, step.place, begun), step)
        by_force = _slid(_pushed(rig, step.table.whole, step), step)
        state = rig.state(middle, step.column, step.outside)
        rubbing = Rubbing(parted.bristles, shares, state, step.length)
        shares, force = rubbing.among(free, by_force)
        middle = middle + _pushed(rig, step.table.half, step) * force
        outside = outside._replace(between=force)
    moved = rates(middle, outside) - times(step.table.matrix, step.place, middle - start)
    return parted.joined(start + times(step.table.whole, step.place, moved), shares)


def _slid(change: Array, step: Step) -> Array:
    """Mean slip [m/s] of a step in which a state changes by so much (n, ...).

    What a bristle bends by is how far the plunger has slid: in a step of a tenth of the period of a
    swing the speed in its middle is off by two parts in a hundred.
    """
    return (change[2] - change[0]) / step.length


def _pushed(rig: Rig, powers: tuple[Array, ...], step: Step) -> Array:
    """Change of state (n, ...) where a newton pushes plunger and cylinder apart.

    - `powers`: of a table, of half a step or all of it.
    """
    total = at_place(powers, step.place)
    return total[:, 3] / rig.plunger_mass - total[:, 1] / rig.cylinder_mass


def _advancer(
    rig: Rig, contact: Array, pump: tuple[Array, Array], grid: Plan, strokes: Strokes
) -> Callable:
    """Return the step of `march`; `pump`: fractions and angles."""
    fractions, angles = pump
    parted = Parted.of(rig)
    track, h = jnp.arange(fractions.shape[1]), grid.interval
    at_switch = strokes.switch[grid.kink_place[:, 0], grid.kink_place[:, 1]]
    extra = jnp.concatenate([jnp.stack([strokes.low, strokes.high]), at_switch])
    matrix = at_work(parted.smooth, Surroundings(contact), rig.column + extra)
    oil = Oil.of(
        rig, Surroundings(contact), rig.column + strokes.low,
        lambda stroke: jnp.clip(strokes.place(rig.column, stroke), -0.5, 1.5),
    )  # fmt: skip
    table = jax.tree.map(lambda a: a[:, :, None], oil.table(matrix[:, :, :2], h, parted.smooth))
    rest = grid.kink_rest[:, None]
    none = jnp.zeros((1, len(parted.kept), matrix.shape[-1]))
    after = step_column(matrix[:, :, 2:], rest, parted.smooth.scales, 4)
    kinks = jnp.concatenate([none, jnp.moveaxis(after, 1, 0)])

    def advance(flat: Array, part: tuple[Array, ...]) -> tuple[Array, None]:
        level, kink, level_after, begin = part
        stroke = flat[2] - flat[0] + 0.5 * h * (flat[3] - flat[1])
        outside = Surroundings(contact, 0.0, fractions[level, track], begin + 0.5 * h, angles)
        place = oil.place(rig, flat, outside, stroke)
        new = _midpoint(parted, flat, Step(outside, rig.column + stroke, h, table, place))

        def kicked(new: Array) -> Array:
            changed = outside._replace(flow_fraction=fractions[level_after, track])
            before, later = (rig.flow(flat, o, rig.column + stroke) for o in (outside, changed))
            smooth, shares = parted.split(new)
            jump = jnp.moveaxis(kinks[kink], 0, 1) * (later - before)
            return parted.joined(smooth + jump, shares)

        return jax.lax.cond(jnp.any(kink > 0), kicked, lambda new: new, new), None

    return advance


def ring(
    rig: Rig,
    preload: Array,
    delay: Array,
    interval: float,
    samples: int,
    coarse: bool = False,
    among: int = 1,
) -> Array:
    """Acceleration of the plate after a release; arguments and result as `release.ring`.

    - `coarse`: as `cut_of`. - `among`: how many intervals make a sample.
    """
    parted = Parted.of(rig)
    parts = max(cut_of(rig.effects, coarse).release // among, 1)
    columns = rig.column + jnp.asarray([0.0, NODE])[:, None]
    matrix = at_work(parted.smooth, FREE, columns)[:, :, :, None]
    h, first = interval / parts, delay / parts
    oil = Oil.of(rig, FREE, rig.column, lambda stroke: stroke / NODE)
    tables = tuple(oil.table(matrix, length, parted.smooth) for length in (h, first))

    def through(flat: Array, table: Table, length: Array | float, begin: Array | float) -> Array:
        def step(i: Array, flat: Array) -> Array:
            stroke = flat[2] - flat[0] + 0.5 * length * (flat[3] - flat[1])
            outside = FREE._replace(time=begin + (i + 0.5) * length)
            place = oil.place(rig, flat, outside, stroke)
            now = Step(outside, rig.column + stroke, length, table, place)
            return _midpoint(parted, flat, now)

        return jax.lax.fori_loop(0, parts, step, flat)

    def advance(flat: Array, number: Array) -> tuple[Array, Array]:
        time = delay + number * interval
        read = rig.motion(flat, FREE._replace(time=time)).plunger_acceleration
        return through(flat, tables[0], h, time), read

    flat = jnp.broadcast_to(rest_under(rig, preload), (len(rig.scales), *delay.shape))
    return jax.lax.scan(advance, through(flat, tables[1], first, 0.0), jnp.arange(samples))[1]
