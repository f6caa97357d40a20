"""Dry friction that falls with speed at first."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.bristle import (
    share_rate,
    sliding_bending,
    sliding_force,
    stribeck_excess,
    stribeck_limit,
    stribeck_speed,
)


class StribeckFriction(AbstractEffect):
    """F_f = -F_C (1 + e exp(-(v/v_S)^2)) sgn(v) when sliding; it takes the place of Coulomb.

    Signature: as Coulomb friction, and more force while the plunger starts, stops or creeps.
    Siblings: Coulomb friction, which it is where no record is slow enough; friction of bristles.
    """

    force: Array = sliding_force()
    excess: Array = stribeck_excess()
    speed: Array = stribeck_speed()
    bending: Array = sliding_bending()

    name: ClassVar[str] = "stribeck-friction"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "a friction force that falls as the plunger starts to move"
    source: ClassVar[str] = "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)"
    scales: ClassVar[tuple[float, ...]] = (1.0,)
    bristle: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return the force of the bristle and the rate at which it bends."""
        (share,) = own
        limit = stribeck_limit(state.slip, self.excess, self.speed)
        rate = share_rate(share, state.slip, self.bending, limit)
        return Action(between=-self.force * share, rates=(rate,))
