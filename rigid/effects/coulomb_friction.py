"""Dry friction that does not depend on speed."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.bristle import share_rate, sliding_bending, sliding_force


class CoulombFriction(AbstractEffect):
    """F_f = -F_C sgn(v_SS) when sliding; what holds it, up to F_C, when not.

    Signature: a step of the pressure by F_C/S, the same at every speed, that turns over when the
    plunger turns; in a hold it stays. Siblings: viscous friction where there is one speed only;
    pressure-dependent friction at one load; a return spring while the plunger only goes out.
    """

    force: Array = sliding_force()
    bending: Array = sliding_bending()

    name: ClassVar[str] = "coulomb-friction"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "a friction force on the plunger that does not depend on speed"
    source: ClassVar[str] = "Dahl 1968, TOR-0158(3107-18)-1, exponent 1, stiff"
    scales: ClassVar[tuple[float, ...]] = (1.0,)
    bristle: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return the force of the bristle and the rate at which it bends."""
        (share,) = own
        return Action(
            between=-self.force * share, rates=(share_rate(share, state.slip, self.bending),)
        )
