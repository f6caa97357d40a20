"""The reference for all faster ways: diffrax on the rig's own equations, any rig, any record.

`march` and `ring` take and return what `slow.march` and `release.ring` do. Each stretch between two
moves of the valve is solved by itself, so that no step passes over one. Where a solve does not come
to its end, its readings are nan.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple, TypeVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from jax import Array
from jax.typing import ArrayLike

from rigid.io.compiled import compiled
from rigid.physics.delay import READ
from rigid.physics.drive import EDGE, STRIDE, Drives
from rigid.physics.rest import rest_under
from rigid.physics.rig import FREE, Rig, Surroundings
from rigid.physics.sensors import Readings, readings
from rigid.physics.strap import GONE

Tree = TypeVar("Tree")

TOLERANCE = 1e-8
FINER = 0.1
"""Tolerance of the equations within a step, in that of the step: left at the same, their error is
taken for one of the step, and steps are refused by the thousand."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES = np.concatenate([0.25 * (NODES - 1.0), 0.25 * (NODES + 1.0)])
WEIGHTS = np.tile(0.25 * WEIGHTS, 2)
"""Of means about an instant, on either side of it, where a valve may switch."""
BEYOND = 4
"""Intervals after the last sample that a record is solved for where readings may be early."""

MAX_STEPS = 200_000
"""Steps of a stretch after which a solve has not ended."""


class Path(NamedTuple):
    """What a solve gives: states at the times asked for (times, n), and whether it ended."""

    states: Array
    ended: Array


def integrate(
    rig: Rig, outside: Surroundings, start: Array, times: Array, tolerance: float = TOLERANCE
) -> Array:
    """States at `times` [s] (first = time of `start`), shape (len(times), n), by Kvaerno5.

    - `rig`: scalar parameters. - `outside`: its time [s] is that at which `times` count 0.
    - `tolerance`: relative; absolute in units of the rig's scales.

    What did not come to its end is nan.
    """
    now, ends = partial(_now, outside), (times[0], times[-1])
    path = _solved(rig, now, start, ends, times, tolerance, np.inf)
    return jnp.where(path.ended, path.states, jnp.nan)


class Given(NamedTuple):
    """What drives a solve, in steps of `length` [s].

    - `straight` (steps + 1, ...): at the ends of steps, straight lines within each. - `level`
      (steps, ...): the same throughout each.
    """

    straight: Array
    level: Array
    length: float


def driven(
    rates: Callable[[Array, Array, Array], Array],
    scales: Sequence[float],
    start: Array,
    given: Given,
    tolerance: float = TOLERANCE,
) -> Array:
    """States (steps + 1, n) under what is given.

    - `rates`: (n,) of a state, of straight inputs and of levels. - `scales` (n,), `start` (n,).

    What comes after a step that did not come to its end is nan.
    """
    length = given.length
    ends, times = (jnp.zeros(()), jnp.asarray(length)), jnp.asarray([length])

    def step(state: Array, within: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        first, last, level = within

        def moved(time: Array, flat: Array) -> Array:
            return rates(flat, first + (last - first) / length * time, level)

        path = solved(moved, scales, state, (ends, times), tolerance, np.inf)
        after = jnp.where(path.ended, path.states[-1], jnp.nan)
        return after, after

    _, states = jax.lax.scan(step, start, (given.straight[:-1], given.straight[1:], given.level))
    return jnp.concatenate([start[None], states])


def _solved(
    rig: Rig,
    now: Callable[[Array | float], Surroundings],
    start: Array,
    ends: tuple[Array, Array],
    times: Array,
    tolerance: float,
    longest: float,
) -> Path:
    """Solve from the first of `ends` to the last, with no step over `longest` [s].

    - `now`: surroundings at a time. - `times` (times,): from end to end, in order.
    """

    def rates(time: Array, flat: Array) -> Array:
        moved = rig.motion(flat, now(time)).rates
        return jnp.stack([jnp.broadcast_to(rate, ()) for rate in moved])

    return solved(rates, rig.scales, start, (ends, times), tolerance, longest)


def solved(
    rates: Callable[[Array, Array], Array],
    scales: Sequence[float],
    start: Array,
    when: tuple[tuple[Array, Array], Array],
    tolerance: float,
    longest: float,
) -> Path:
    """Solve by Kvaerno5, with no step over `longest` [s].

    - `rates`: (n,) of a time and a state (n,). - `scales` (n,): in which errors are measured.
    - `when`: first and last instant, and the times (times,) that are asked for, in order [s].
    """
    (begin, end), times = when
    sized = jnp.asarray(scales)

    def field(time: ArrayLike, scaled: Array, _: None) -> Array:
        return rates(jnp.asarray(time), scaled * sized) / sized

    finer = FINER * tolerance
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Kvaerno5(root_finder=optimistix.Newton(rtol=finer, atol=finer)),
        begin,
        end,
        None,
        start / sized,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance, dtmax=longest),
        max_steps=MAX_STEPS,
        throw=False,
        adjoint=diffrax.ForwardMode(),  # all derivatives that are taken are directional
    )
    path = solution.ys
    assert path is not None  # it is what SaveAt(ts) asks for
    return Path(path * sized, solution.result == diffrax.RESULTS.successful)


class Strap(NamedTuple):
    """What holds the plate back until it has let go.

    - `preload` [N]. - `edges` (edges, ...) [s]: instants by which the shares GONE of it have gone.
    """

    preload: Array
    edges: Array

    def force(self, time: ArrayLike) -> Array:
        """Force on the plate at an instant [N], of one walker."""
        gone = jnp.interp(time, self.edges, jnp.asarray(GONE))
        return -self.preload * (1.0 - jnp.where(time >= self.edges[-1], 1.0, gone))


def _now(outside: Surroundings, time: ArrayLike, strap: "Strap | None" = None) -> Surroundings:
    """Surroundings at a time, counted as theirs is."""
    now = outside._replace(time=outside.time + time)
    return now if strap is None else now._replace(force=now.force + strap.force(time))


@compiled
def _stretch(
    rigs: Rig,
    outside: Surroundings,
    start: Array,
    ends: tuple[Array, Array],
    asked: Array,
    tolerance: float,
    longest: float,
    strap: "Strap | None" = None,
) -> tuple[Array, Readings]:
    """State where a stretch ends (n, walkers), and readings (times, walkers) at `asked`.

    - `rigs`, `outside`, `start` (n, walkers), `asked` (times, walkers) [s], `strap`: by walker.

    Of times outside the stretch the readings are those at its nearer end.
    """

    def one(
        rig: Rig, outside: Surroundings, start: Array, asked: Array, strap: Strap | None
    ) -> tuple:
        times = jnp.append(jnp.clip(asked, *ends), ends[1])
        path = _solved(
            rig, partial(_now, outside, strap=strap), start, ends, times, tolerance, longest
        )
        states = jnp.where(path.ended, path.states, jnp.nan)

        def read(y: Array, time: Array) -> Readings:
            read = readings(rig, y, _now(outside, time, strap))
            return Readings(*(jnp.broadcast_to(r, ()) for r in read))

        return states[-1], jax.vmap(read)(states[:-1], times[:-1])

    # One after another: side by side all would take the steps of each, and copy all that is kept.
    arrays, rest = eqx.partition((rigs, outside, start, asked, strap), eqx.is_array)
    first = jax.tree.map(lambda leaf: jnp.moveaxis(leaf, -1, 0), arrays)
    found = jax.lax.map(lambda each: one(*eqx.combine(each, rest)), first)
    return jax.tree.map(lambda leaf: jnp.moveaxis(leaf, 0, -1), found)


def march(
    rig: Rig,
    contact: Array,
    fractions: Array,
    drives: Drives,
    angles: Array,
    tolerance: float,
) -> dict[str, Array]:
    """Simulate a group of slow records from rest; arguments and result as `staggered.march`."""
    walkers, longest = fractions.shape[2], STRIDE * drives.interval
    rigs, lags, mean = _by_walker(rig, walkers), rig.delays(), rig.averaging()
    start = _by_walker(rest_under(rig, 0.0, contact), walkers)
    columns = []
    for track in range(len(drives.samples)):
        way = _laid(jnp.asarray(track), contact, fractions, drives, angles, lags, mean)
        flat, found = start, None
        for flow, ends, here in zip(way.flows, way.ends, way.here, strict=True):
            flat, series = _stretch(rigs, flow, flat, ends, way.every, tolerance, longest)
            found = series if found is None else _overlaid(here, series, found)
        read = {q: jnp.take_along_axis(getattr(found, q), at, 0) for q, at in way.rows.items()}
        columns.append({q: _averaged(series, drives.size, mean) for q, series in read.items()})
    return {q: jnp.stack([column[q] for column in columns], axis=1) for q in READ}


class _Way(NamedTuple):
    """One record: what drives it, and what is asked of it.

    - `flows`: surroundings, by stretch. - `ends` [s]: of each stretch. - `here` (times, walkers):
      by stretch, which instants it has, or a later one. - `every` (times, walkers) [s]: instants
      that are asked for, in order. - `rows` (samples, walkers): by quantity, its own among these.
    """

    flows: list[Surroundings]
    ends: list[tuple[Array, Array]]
    here: list[Array]
    every: Array
    rows: dict[str, Array]


@compiled
def _laid(
    track: Array,
    contact: Array,
    fractions: Array,
    drives: Drives,
    angles: Array,
    lags: dict[str, Array],
    mean: tuple[Array, Array] | None,
) -> _Way:
    """Lay out a record in one program: each operation by itself would be compiled as one."""
    walkers, interval = fractions.shape[2], drives.interval
    times = interval * jnp.minimum(jnp.arange(drives.size), drives.samples[track] - 1)
    last = drives.end[track] + (BEYOND * interval if lags or mean is not None else 0.0)
    about = jnp.zeros((1, 1)) if mean is None else about_an_instant(interval * mean[1])
    instants = (times[:, None] + about[:, None]).reshape(-1, about.shape[1])
    on_time = _asked(instants, 0.0, last, walkers)
    asked = {q: _asked(instants, lags[q], last, walkers) if q in lags else on_time for q in READ}
    shared = _alike(asked)
    every = jnp.concatenate(list(shared.values()))
    order = jnp.argsort(every, axis=0)
    every = jnp.take_along_axis(every, order, axis=0)
    rows = dict(zip(shared, jnp.split(jnp.argsort(order, axis=0), len(shared)), strict=True))
    bounds = (jnp.zeros(()), *drives.switches[track], jnp.asarray(jnp.inf, float))
    ends = []
    for begin, end in pairwise(bounds):
        # From the last sample on nothing is asked for: a short stretch stands for what never comes.
        idle = begin >= last
        after = jnp.where(idle, last + interval, jnp.minimum(end, last))
        ends.append((jnp.where(idle, last, begin), after))
    return _Way(
        [_flow(contact, f, angles[track]) for f in fractions[drives.levels[track], track]],
        ends,
        [every >= begin - EDGE * interval for begin in bounds[:-1]],
        every,
        {q: rows[_key(asked, q)] for q in asked},
    )


def _flow(contact: Array, fraction: Array, angle: Array) -> Surroundings:
    """Surroundings of one record at a level of its valve; time 0 is its first sample."""
    parts = (contact, 0.0, fraction, 0.0, angle)
    return Surroundings(*(jnp.broadcast_to(jnp.asarray(p, float), fraction.shape) for p in parts))


def _asked(times: Array, lag: ArrayLike, last: Array, walkers: int) -> Array:
    """Times (times, walkers) at which what is read was there; none before 0 or after `last`."""
    return jnp.clip(times - jnp.broadcast_to(lag, (walkers,)), 0.0, last)


def about_an_instant(width: Array) -> Array:
    """Times (nodes + 1, walkers) [s] after an instant: itself, nodes over a `width` about it."""
    return jnp.concatenate([jnp.zeros(1), NODES])[:, None] * width


def _averaged(series: Array, times: int, mean: tuple[Array, Array] | None) -> Array:
    """Readings (times, walkers) of those at all nodes (nodes * times, walkers), instants first."""
    if mean is None:
        return series
    each = series.reshape(-1, times, series.shape[1])
    return each[0] + mean[0] * (jnp.tensordot(WEIGHTS, each[1:], axes=1) - each[0])


@compiled
def _overlaid(here: Array, series: Readings, before: Readings) -> Readings:
    """Take a stretch where it is, what was before elsewhere."""
    return Readings(*(jnp.where(here, a, b) for a, b in zip(series, before, strict=True)))


def _key(asked: dict[str, Array], quantity: str) -> str:
    """Return the first quantity that asks for the same times."""
    return next(q for q in asked if asked[q] is asked[quantity])


def _alike(asked: dict[str, Array]) -> dict[str, Array]:
    """Keep each set of times once."""
    return {q: times for q, times in asked.items() if _key(asked, q) == q}


def _by_walker(tree: Tree, walkers: int) -> Tree:
    """Give every array of a tree a last axis of `walkers`."""

    def wide(leaf: Array) -> Array:
        return jnp.broadcast_to(leaf, (*leaf.shape[:-1], walkers))

    arrays, rest = eqx.partition(tree, eqx.is_array)
    return eqx.combine(jax.tree.map(wide, arrays), rest)


def ring(
    rig: Rig,
    preload: Array,
    delay: Array,
    interval: float,
    samples: int,
    tolerance: float = TOLERANCE,
) -> Array:
    """Acceleration of the plate after a sudden release; arguments and result as `release.ring`."""
    law = jnp.zeros((len(GONE), *preload.shape))
    return let_go(rig, preload, law, (delay, interval), samples, tolerance)


def let_go(
    rig: Rig,
    preload: Array,
    law: Array,
    sampled: tuple[Array, float],
    samples: int,
    tolerance: float = TOLERANCE,
) -> Array:
    """Acceleration of the plate when the strap's force falls by a law, (samples, tracks, walkers).

    - `law` (edges, tracks, walkers) [s]: as `rigid.physics.strap.edges` gives it.
    - `sampled`: time of the first sample after the release time (tracks, walkers), interval [s].
    """
    walkers, (first, interval) = preload.shape[1], sampled
    rigs, outside = _by_walker(rig, walkers), FREE._replace(time=0.0)
    outside = Surroundings(*(jnp.broadcast_to(jnp.asarray(p, float), (walkers,)) for p in outside))
    columns = []
    for track, load in enumerate(preload):
        begins, asked = law[0, track], first[track] + interval * jnp.arange(samples)[:, None]
        strap = Strap(load, law[:, track] - begins)
        start = _by_walker(rest_under(rig, load), walkers)
        ends = (jnp.zeros(()), jnp.maximum(jnp.max(asked - begins), interval))
        swung = _stretch(
            rigs, outside, start, ends, asked - begins, tolerance, STRIDE * interval, strap
        )
        columns.append(jnp.where(asked > begins, swung[1].acceleration, 0.0))
    return jnp.stack(columns, axis=1)
