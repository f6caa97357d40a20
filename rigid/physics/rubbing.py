"""What bristles of dry friction do in a step: it is implicit in them alone.

Their mean force follows from the mean slip, and the mean slip from their force. The force falls as
the slip grows and the slip falls with the force, so that both agree at one slip alone. A bristle
relaxes at a rate that goes with the speed, linearly in the share that it carries: what it does is
exact while the slip stays.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, State
from rigid.physics.step_matrices import growths

FAST = 10.0
"""Slip [m/s] at which any bristle slides."""

SETTLED, STILL = 1e-10, 1e-14
"""The slip at which bristles and rig agree is found when a step of Newton's method changes it by no
more than this share and so many m/s. A slip that is left before jumps where a plunger turns: by
2e-8 m, after two steps, when a bending of 1 um changed by a millionth; slopes by differences were
wrong."""

MOST_TURNS = 12
"""Steps toward that slip at most; three to seven find it for all of 24 draws of the priors."""


def led(
    bristle: AbstractEffect, state: State, share: Array, length: Array | float
) -> tuple[Array, Array]:
    """Share that a bristle carries after `length` [s] at the slip of a state, and its mean force.

    The force [N] is that between plunger and cylinder. Exact, since a bristle's rate is linear in
    its share while the slip stays.
    """

    def rate(share: Array) -> Array:
        return bristle(state, (share,)).rates[0]

    now, slope = jax.jvp(rate, (share,), (jnp.ones_like(share),))
    whole, ramp = growths(slope * length)
    end = share + length * whole * now
    mean = share + length * ramp * now
    return end, jnp.asarray(bristle(state, (mean,)).between)


class Rubbed(NamedTuple):
    """What bristles do in a step: the shares that they end with, and their mean force [N]."""

    shares: tuple[Array, ...]
    force: Array


class _Search(NamedTuple):
    """How far a search for the slip of a step has come.

    - `slip` [m/s]: where it looks next. - `at` [m/s]: where it looked last. - `found`: what
      bristles do there. - `open`: whether that still moves the slip of any walker. - `turn`: how
      often it has looked.
    """

    slip: Array
    at: Array
    found: Rubbed
    open: Array
    turn: Array


class Rubbing(NamedTuple):
    """Bristles in a step.

    - `bristles`; `shares`: that each carries when the step begins. - `state`: of the rig without
      them in its middle. - `length` [s]: of the step.
    """

    bristles: tuple[AbstractEffect, ...]
    shares: tuple[Array, ...]
    state: State
    length: Array | float

    def at(self, slip: Array) -> Rubbed:
        """What they do where that is the mean slip [m/s]."""
        state, own = self._slipping(slip), zip(self.bristles, self.shares, strict=True)
        found = [led(bristle, state, share, self.length) for bristle, share in own]
        return Rubbed(tuple(end for end, _ in found), reduce(add, (force for _, force in found)))

    def among(self, free: Array, by_force: Array) -> Rubbed:
        """What they do where the rig yields.

        - `free`: mean slip without their force [m/s]. - `by_force`: slip that a newton of it makes
          [m/s/N].
        """
        return _agreed(self, free, by_force)[1]

    def excess(self, slip: Array, free: Array, by_force: Array) -> tuple[Array, Rubbed]:
        """By how much a slip is more than what the rig makes of their force, and what they do."""
        found = self.at(slip)
        return slip - free - by_force * found.force, found

    def side(self, free: Array, by_force: Array) -> Array:
        """To which side they slip, -1, 0 or 1: that of the slip which force at rest leaves."""
        return jnp.sign(free + by_force * self._held())

    def _held(self) -> Array:
        """Force [N] at rest, where every share stays as it is: it changes as the speed does."""
        state, own = self._slipping(jnp.zeros(())), zip(self.bristles, self.shares, strict=True)
        held = [jnp.asarray(bristle(state, (share,)).between) for bristle, share in own]
        return reduce(add, held)

    def _slipping(self, slip: Array) -> State:
        return self.state._replace(v_plunger=self.state.v_cylinder + slip)


@jax.custom_jvp
def _agreed(rubbing: Rubbing, free: Array, by_force: Array) -> tuple[Array, Rubbed]:
    """The slip at which bristles and rig agree, and what the bristles do there.

    The way to it is not differentiated: how the slip moves follows from where it is. So slopes
    take two turns however many led there, and reverse mode works, which fails for such a loop.
    """
    side = rubbing.side(free, by_force)

    def toward(search: _Search) -> _Search:
        def excess(slip: Array) -> tuple[Array, Rubbed]:
            return rubbing.excess(slip, free, by_force)

        at = search.slip
        off, slope, found = jax.jvp(excess, (at,), (jnp.ones_like(free),), has_aux=True)
        slip = side * jnp.maximum(side * (at - off / slope), 0.0)
        change = jnp.abs(slip - at)
        moves = jnp.any(change > SETTLED * jnp.abs(slip) + STILL)
        return _Search(slip, at, found, moves, search.turn + 1)

    # In a loop: beside each other, every turn would work out again what all of them take.
    none = jnp.zeros_like(free)
    nothing = Rubbed(tuple(none for _ in rubbing.shares), none)
    start = _Search(side * FAST, none, nothing, jnp.asarray(True), jnp.asarray(0))
    ended = jax.lax.while_loop(lambda s: s.open & (s.turn < MOST_TURNS), toward, start)
    return ended.at, ended.found


@_agreed.defjvp
def _moved(given: tuple, change: tuple) -> tuple:
    """How both move: the excess stays nothing."""
    slip, found = _agreed(*given)
    (_, _), (push, held) = jax.jvp(lambda *rig: rig[0].excess(slip, *rig[1:]), given, change)
    one = (jnp.ones_like(slip),)
    (_, _), (slope, by_slip) = jax.jvp(lambda slip: given[0].excess(slip, *given[1:]), (slip,), one)
    drift = -push / slope
    more = jax.tree.map(lambda still, each: still + each * drift, held, by_slip)
    return (slip, found), (drift, more)
