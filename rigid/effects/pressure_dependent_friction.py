"""Friction of a seal that the oil presses on."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.bristle import share_rate, sliding_bending
from rigid.effects.declare import any_size, parameter

LEAST_PRESSURE = 1e4
"""Pascal over which the seal's force sets in, so that suction does not turn it round."""


def pressing(pressure: Array) -> Array:
    """Pressure that presses the seal [Pa]: p_0 log((1 + exp(p/p_0))/2), p_0 = LEAST_PRESSURE.

    Written so that no pressure is exactly 0: a machine without any must not show a trace of it.
    """
    half = 0.5 * pressure / LEAST_PRESSURE
    size = jnp.abs(half)
    return LEAST_PRESSURE * (half + size + jnp.log1p(0.5 * jnp.expm1(-2.0 * size)))


class PressureDependentFriction(AbstractEffect):
    """F_f = -c p sgn(v_SS) when sliding; what holds it, up to c p, when not.

    Signature: the pressure leads the load by c/S when loading and trails it when unloading; nothing
    in a run out of load. Siblings: another effective area, which is the same without unloading;
    Coulomb friction at one load.
    """

    coefficient: Array = parameter(
        "c_seal",
        r"c_\mathrm{s}",
        "m^2",
        any_size(5e-5),
        meaning="seal friction per pressure",
        absent=0.0,
    )
    bending: Array = sliding_bending("presliding_seal", r"z_\mathrm{seal}")

    name: ClassVar[str] = "pressure-dependent-friction"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "seal friction that grows with the oil pressure"
    source: ClassVar[str] = "seal friction by contact pressure; Dahl's bristle as for Coulomb"
    scales: ClassVar[tuple[float, ...]] = (1.0,)
    bristle: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return the force of the bristle and the rate at which it bends."""
        (share,) = own
        limit = self.coefficient * pressing(state.pressure)
        return Action(between=-limit * share, rates=(share_rate(share, state.slip, self.bending),))
