"""A sampling interval as one linear step, made of the short steps that it is parted into.

With y(j+1) = E y(j) + c + G w(j) for k short steps, whatever happens within the interval is linear
in the state y at its beginning and in the movements w of all its steps side by side:

    y(k) = E^k y + D + W w,    shown(j) = R(j) y + d(j) + T(j) w    for j = 0 .. k-1

so that filter and smoother take one step an interval and still tell every step in it.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.smoothing.model import Nodes


class Interval(NamedTuple):
    """An interval of `k` steps and the sensors at its beginning, at nodes or at one sample.

    - `step` (n, n): E^k. - `drift` (n,): D. - `entry` (n, k inputs): W, by step, then by input.
    - `rows` (k shown, n), `rest` (k shown,), `within` (k shown, k inputs): R, d and T of what is
      shown, by step.
    - `sense` (channels, n), `offset` (channels,): of the sensors, SI.
    """

    step: Array
    drift: Array
    entry: Array
    rows: Array
    rest: Array
    within: Array
    sense: Array
    offset: Array


def intervals(table: Nodes, rows: Array, steps: int) -> Interval:
    """Put the steps of an interval together at every node of one draw.

    - `rows` (shown, n): what is shown of a state. - `steps`: of an interval.
    """
    return jax.vmap(lambda at: _interval(at, rows, steps))(table)


def _interval(at: Nodes, rows: Array, steps: int) -> Interval:
    n, shown = rows.shape[1], rows.shape[0]
    power, drift = jnp.eye(n), jnp.zeros(n)
    seen, rest, entered = [], [], []
    for _ in range(steps):
        seen.append(rows @ power)
        rest.append(rows @ drift)
        entered.append(power @ at.entry)
        power, drift = at.step @ power, at.step @ drift + at.drift
    nothing = jnp.zeros((shown, at.entry.shape[1]))
    within = [
        jnp.concatenate([rows @ entered[j - 1 - i] if i < j else nothing for i in range(steps)], 1)
        for j in range(steps)
    ]
    return Interval(
        step=power,
        drift=drift,
        entry=jnp.concatenate(entered[::-1], axis=1),
        rows=jnp.concatenate(seen),
        rest=jnp.concatenate(rest),
        within=jnp.concatenate(within),
        sense=at.sense,
        offset=at.offset,
    )


def at_place(left: Interval, change: Interval, place: Array) -> Interval:
    """Interpolate from a node on; `change`: to the next node, `place`: the way there, 0 to 1."""
    return jax.tree.map(lambda start, slope: start + place * slope, left, change)


def along(
    step: Callable[[Any, Any, Interval], tuple[Any, Any]],
    start: Any,
    table: Interval,
    given: tuple[Array, Any],
    reverse: bool = False,
) -> tuple[Any, Any]:
    """Scan over the samples of a block, from node to node, and give what `jax.lax.scan` does.

    - `step`: of carry, sample and its interval. - `table`: at nodes. - `given`: place of every
      sample, and whatever goes to `step`, (samples, ...); as many samples from each node on.
    """
    cells = table.step.shape[0] - 1
    left = jax.tree.map(lambda t: t[:-1], table)
    change = jax.tree.map(lambda t: t[1:] - t[:-1], table)
    parted = jax.tree.map(lambda x: x.reshape(cells, -1, *x.shape[1:]), given)

    def cell(carry: Any, here: Any) -> tuple[Any, Any]:
        left, change, samples = here

        def one(carry: Any, sample: tuple[Array, Any]) -> tuple[Any, Any]:
            return step(carry, sample[1], at_place(left, change, sample[0]))

        return jax.lax.scan(one, carry, samples, reverse=reverse)

    end, found = jax.lax.scan(cell, start, (left, change, parted), reverse=reverse)
    return end, jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), found)
