"""Where the pump's flow falls within a step: at its change of stage the oil flow is stiff.

Step matrices are made of a rig whose flow does not change with pressure. Where it does, what the
flow has changed on the mean of a step is found together with the pressure that it leads to, by
Simpson's rule over the step and Newton's method. Source: Hochbruck and Ostermann 2010, Acta
Numerica 19, sec. 2 (the part of the rates that is not linear, as a mean over the step).
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.rig import Rig, Surroundings

NEWTON_STEPS = 2
"""The flow bends over 20 bar and a step leads on by a few: a third moves nothing that is seen."""

UNSEEN = 30.0
"""Pressure [Pa], a hundredth of a tenth of the gauge's step, by which a bend may put off a step."""

STEEP = 1e4
"""Pressure [Pa] that a bend may hold back in a part of a sample before it is cut once more: where
one held back eighty times as much, at 400 bar/s, the part's end was off by this, 0.3 steps."""

Flow = Callable[[Array], Array]
"""Pressure [Pa] to what the oil that flows in adds to the rate of pressure [Pa/s]."""


def flow_at(rig: Rig, flat: Array, outside: Surroundings, column: Array) -> Flow:
    """Return the flow as a function of the pressure alone, all else as in a flat state."""
    return lambda pressure: rig.flow(flat.at[4].set(pressure), outside, column)


def bends(flow: Flow, pressure: Array, rate: Array, length: float, most: float = UNSEEN) -> Array:
    """Whether the flow changes over a step by more than `most` [Pa], for any walker.

    - `pressure` [Pa], `rate` [Pa/s]: at its begin. - `length` [s].
    """
    change = flow(pressure + length * rate) - flow(pressure)
    return jnp.any(jnp.abs(change) * length > most)


def mean_excess(flow: Flow, begin: Array, end: Array, share: Array) -> Array:
    """By how much the flow's mean over a step is more than what it begins with [Pa/s].

    - `begin`: pressure where the step begins; `end`: where it would end under constant flow [Pa].
    - `share` [s]: by how much a unit of flow more raises the pressure at the end.
    """
    first = flow(begin)

    def excess(pressure: Array) -> Array:
        last = flow(pressure)
        # Between its ends the path is a cubic whose slope changes as the flow does.
        halfway = flow(0.5 * (begin + pressure) - 0.125 * share * (last - first))
        return (first + 4.0 * halfway + last) / 6.0 - first

    def newton(_: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        pressure, _ = carry
        more, slope = jax.jvp(excess, (pressure,), (jnp.ones_like(pressure),))
        return pressure + (end + share * more - pressure) / (1.0 - share * slope), more

    # A turn more than steps: what the flow is where the last one ends.
    return jax.lax.fori_loop(0, NEWTON_STEPS + 1, newton, (end, jnp.zeros_like(end)))[1]


def mean_straight(flow: Flow, begin: Array, end: Array, share: Array) -> Array:
    """The same where the flow hardly bends: it changes as its slope at the begin says [Pa/s]."""
    _, slope = jax.jvp(flow, (begin,), (jnp.ones_like(begin),))
    return 0.5 * slope * (end - begin) / (1.0 - 0.5 * share * slope)
