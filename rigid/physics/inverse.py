"""The force that a measured motion takes: the balance of forces of one body, solved for the force.

Where a controller moves the body, its force answers to the position, and a simulation under the
recorded force drifts away from what was measured. The balance of forces along the measured motion
has no such loop:

    F = m a - S p - (what the effects push)

with everything positive toward positive position; F is read by the force sensor, p pushes outward.
Effects with states of their own (bristles, branches with memory) are led along the motion by an
exponential step, exact for a state that is linear while the speed stays as it is. Sources: Janot,
Vandanjon and Gautier 2014, IEEE Trans. Control Systems Technology 22(1), for the inverse model;
Hochbruck and Ostermann 2010, Acta Numerica 19, for the step.

Arrays are (nodes, tracks, walkers); those of the motion have no walkers.
"""

from collections.abc import Mapping
from functools import reduce
from operator import add, mul

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, Seen, State, delays_of
from rigid.physics.step_matrices import mean_growth

Own = tuple[tuple[Array, ...], ...]

FORCE = "force"
"""What is read of a motion, by its name among `delays`."""
STENCIL = (-2, -1, 0, 1, 2, 3)
"""Nodes behind one, between the two in the middle of which a late reading lies."""


class Along(eqx.Module):
    """A measured motion on evenly spaced nodes.

    - `position` [m], `velocity` [m/s], `acceleration` [m/s^2], `pressure` [Pa]: (nodes,), or
      (nodes, tracks) of several. - `first` [s]: time of the first node, (), or (tracks,).
    - `kernel` (taps,): the low-pass that the force has gone through, an odd number of weights.
    - `interval` [s]: between nodes. - `stride`: nodes between two samples of the force, the first
      of which is that under the middle of the kernel at the very beginning.
    """

    position: Array = eqx.field(converter=jnp.asarray)
    velocity: Array = eqx.field(converter=jnp.asarray)
    acceleration: Array = eqx.field(converter=jnp.asarray)
    pressure: Array = eqx.field(converter=jnp.asarray)
    first: Array = eqx.field(converter=jnp.asarray)
    kernel: Array = eqx.field(converter=jnp.asarray)
    interval: float = eqx.field(static=True)
    stride: int = eqx.field(static=True)


def together(runs: list[Along]) -> Along:
    """Lay motions of the same spacing side by side; a shorter one stays where it ends."""
    nodes = max(len(run.position) for run in runs)

    def joined(name: str, mode: str) -> Array:
        parts = [getattr(run, name) for run in runs]
        return jnp.stack([jnp.pad(p, (0, nodes - len(p)), mode=mode) for p in parts], axis=1)

    one = runs[0]
    return Along(
        joined("position", "edge"),
        joined("velocity", "constant"),
        joined("acceleration", "constant"),
        joined("pressure", "edge"),
        jnp.stack([run.first for run in runs]),
        one.kernel,
        one.interval,
        one.stride,
    )


class Body(eqx.Module):
    """What moves; each (walkers,).

    - `mass` [kg]. - `area` [m^2]: that the pressure acts on. - `effects`: what acts on it.
    """

    mass: Array
    area: Array
    effects: tuple[AbstractEffect, ...]


def build_body(effects: tuple[type[AbstractEffect], ...], values: Mapping[str, Array]) -> Body:
    """Make a body from flat values: `M_Pl`, `S_Pl` and the effects'."""
    return Body(
        mass=jnp.asarray(values["M_Pl"]),
        area=jnp.asarray(values["S_Pl"]),
        effects=tuple(effect.build(values) for effect in effects),
    )


def force(body: Body, along: Along) -> Array:
    """Force that the sensor reads, through the low-pass, (samples, tracks, walkers) [N].

    - `along`: motions side by side.
    """
    state = _states(body, along)
    taken = body.mass * along.acceleration[..., None] - body.area * state.pressure
    for effect, states in zip(body.effects, _led(body, along), strict=True):
        action = effect(state, states)
        taken = taken - action.between - action.on_plunger
    late = delays_of(body.effects).get(FORCE)
    if late is not None:
        taken = delayed(taken, late / along.interval)
    return filtered(taken, along.kernel, along.stride)


def delayed(series: Array, lag: Array) -> Array:
    """A series (nodes, tracks, walkers) as it was `lag` (walkers,) nodes before.

    Between nodes lies the polynomial through six of them; beyond the ends it stays as it is there.
    """
    series, lag = jnp.broadcast_to(series, (*series.shape[:2], *jnp.broadcast_shapes(
        series.shape[2:], jnp.shape(lag)))), jnp.atleast_1d(lag)  # fmt: skip
    whole = jnp.floor(lag)
    last = series.shape[0] - 1
    nodes = jnp.arange(last + 1)[:, None] - whole.astype(int)
    return reduce(add, (
        weight * jnp.take_along_axis(series, jnp.clip(nodes - back, 0, last)[:, None], axis=0)
        for back, weight in zip(STENCIL, _between_nodes(lag - whole), strict=True)
    ))  # fmt: skip


def _between_nodes(back: Array) -> list[Array]:
    """Weights of the nodes STENCIL behind, at `back` nodes behind (Lagrange's polynomials)."""
    return [
        reduce(mul, ((back - other) / (one - other) for other in STENCIL if other != one))
        for one in STENCIL
    ]


def filtered(series: Array, kernel: Array, stride: int) -> Array:
    """Weighted means of a series under the kernel, every `stride` nodes, along the first axis.

    - `kernel` (taps,): symmetric. Nothing is made up beyond the ends: of n nodes there remain
      1 + (n - taps) // stride.
    """
    taps = kernel.shape[0]
    span = stride * ((series.shape[0] - taps) // stride) + 1
    return reduce(add, (kernel[j] * series[j : j + span : stride] for j in range(taps)))


def _states(body: Body, along: Along) -> State:
    """Return the states at all nodes; the body slides on what does not move."""
    time = along.first + along.interval * jnp.arange(along.position.shape[0])[:, None]
    still = jnp.zeros_like(along.position)[..., None]
    return State(
        x_cylinder=still,
        v_cylinder=still,
        x_plunger=along.position[..., None],
        v_plunger=along.velocity[..., None],
        pressure=along.pressure[..., None],
        column=still,
        area=body.area,
        time=time[..., None],
    )


def _between(body: Body, along: Along) -> State:
    """Return the states in the middle of each step, the speed being what the step covers."""
    state = _states(body, along)
    middle = jax.tree.map(
        lambda x: 0.5 * (x[1:] + x[:-1]) if jnp.ndim(x) == 3 else x, state
    )  # fmt: skip
    return middle._replace(v_plunger=jnp.diff(state.x_plunger, axis=0) / along.interval)


def _led(body: Body, along: Along) -> Own:
    """States of the effects' own at all nodes, 0 at the first; () for effects without any."""
    effects = body.effects
    if not any(effect.scales for effect in effects):
        return tuple(() for _ in effects)
    middles = _between(body, along)
    moving = {k: v for k, v in middles._asdict().items() if jnp.ndim(v) == 3}
    shape = jnp.broadcast_shapes((*along.position.shape[1:], 1), body.area.shape)
    rest = tuple(tuple(jnp.zeros(shape) for _ in effect.scales) for effect in effects)

    def advance(own: Own, row: dict[str, Array]) -> tuple[Own, Own]:
        state = middles._replace(**row)
        new = tuple(
            _stepped(effect, state, states, along.interval)
            for effect, states in zip(effects, own, strict=True)
        )
        return new, new

    path = jax.lax.scan(advance, rest, moving)[1]
    return jax.tree.map(lambda start, later: jnp.concatenate([start[None], later]), rest, path)


def _stepped(
    effect: AbstractEffect, state: State, own: tuple[Array, ...], length: float
) -> tuple[Array, ...]:
    """Lead an effect's own states on; none of them acts upon another."""

    def rates(states: tuple[Array, ...]) -> tuple[Array, ...]:
        action: Action = effect(state, states)
        return effect.rates(action, Seen(state, states, 0.0, 0.0))

    ones = tuple(jnp.ones_like(s) for s in own)
    moved, bends = jax.jvp(rates, (own,), (ones,)) if own else ((), ())
    return tuple(
        s + length * mean_growth(length * bend) * rate
        for s, rate, bend in zip(own, moved, bends, strict=True)
    )
