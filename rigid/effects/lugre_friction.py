"""Friction of bristles that bend visibly before they slide."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.bristle import (
    share_rate,
    sliding_force,
    stribeck_excess,
    stribeck_limit,
    stribeck_speed,
)
from rigid.effects.declare import lognormal, parameter


class LuGreFriction(AbstractEffect):
    """F_f = -F_C (s + t_b ds/dt), s the share that a bristle of bending z carries.

    Their damping sigma_1 is F_C t_b/z: it goes with the force, so that without it there is none.
    The viscous part of the law is the effect `viscous-friction`. Signature: a spring of F_C/z in
    the first tenths of a millimetre after a turn and in the release, Stribeck's law when sliding.
    Siblings: Stribeck and Coulomb friction where the bending is below the stroke sensor's step;
    in the release the storage of a branch with memory.
    """

    force: Array = sliding_force()
    excess: Array = stribeck_excess()
    speed: Array = stribeck_speed()
    bending: Array = parameter(
        "z_bristle",
        r"z_\mathrm{s}",
        "m",
        lognormal(1e-4, 3.0),
        meaning="bending at which a bristle slides",
    )
    delay: Array = parameter(
        "bristle_time",
        r"t_\mathrm{b}",
        "s",
        lognormal(2e-3, 3.0),
        meaning="time in which a bristle's own damping acts",
    )

    name: ClassVar[str] = "lugre-friction"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "a friction force of bristles that bend before they slide"
    source: ClassVar[str] = "Canudas de Wit et al. 1995, IEEE Trans. Autom. Control 40(3)"
    scales: ClassVar[tuple[float, ...]] = (1.0,)
    bristle: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return the force of the bristle and the rate at which it bends."""
        (share,) = own
        limit = stribeck_limit(state.slip, self.excess, self.speed)
        rate = share_rate(share, state.slip, self.bending, limit)
        return Action(between=-self.force * (share + self.delay * rate), rates=(rate,))
