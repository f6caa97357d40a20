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

    - `slip` [m/s]: where it looks next. - `found`: what bristles do where it looked last.
    - `open`: whether that still moves the slip of any walker. - `turn`: how often it has looked.
    """

    slip: Array
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

        def excess(slip: Array) -> tuple[Array, Rubbed]:
            found = self.at(slip)
            return slip - free - by_force * found.force, found

        side = jnp.sign(free + by_force * self._held())

        def toward(search: _Search) -> _Search:
            here, direction = (search.slip,), (jnp.ones_like(free),)
            off, slope, found = jax.jvp(excess, here, direction, has_aux=True)
            slip = side * jnp.maximum(side * (search.slip - off / slope), 0.0)
            change = jnp.abs(slip - search.slip)
            moves = jnp.any(change > SETTLED * jnp.abs(slip) + STILL)
            return _Search(slip, found, moves, search.turn + 1)

        # In a loop: beside each other, every turn would work out again what all of them take.
        none = jnp.zeros_like(free)
        nothing = Rubbed(tuple(none for _ in self.shares), none)
        start = _Search(side * FAST, nothing, jnp.asarray(True), jnp.asarray(0))
        return jax.lax.while_loop(lambda s: s.open & (s.turn < MOST_TURNS), toward, start).found

    def _held(self) -> Array:
        """Force [N] at rest, where every share stays as it is: it changes as the speed does."""
        state, own = self._slipping(jnp.zeros(())), zip(self.bristles, self.shares, strict=True)
        held = [jnp.asarray(bristle(state, (share,)).between) for bristle, share in own]
        return reduce(add, held)

    def _slipping(self, slip: Array) -> State:
        return self.state._replace(v_plunger=self.state.v_cylinder + slip)
