"""A part of one's own: a servo valve between supply and tank."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects import AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter

HALF_SUPPLY = 105e5
"""Half of the supply pressure [Pa], at which both chambers rest."""


class ServoValve(AbstractEffect):
    """Q = K u sqrt(p_S - p) while the command u is above zero, K u sqrt(p) while it is below."""

    gain: Array = parameter(
        "K_valve",
        r"K_\mathrm{v}",
        "m^3/s/sqrt(Pa)",
        lognormal(3e-7, 3.0),
        meaning="gain of the servo valve",
    )

    name: ClassVar[str] = "servo-valve"
    equation: ClassVar[str] = "pump"
    phrase: ClassVar[str] = "a servo valve throttles the flow to and from the chamber"
    source: ClassVar[str] = (
        "Merritt 1967, Hydraulic Control Systems, ch. 5: flow of a sharp orifice"
    )
    exact: ClassVar[str] = "the supply pressure, 210 bar"

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow at a command of 1; the joint multiplies by the command."""
        open_ = jnp.asarray(state.flow_fraction) > 0.0
        drop = jnp.where(open_, HALF_SUPPLY - state.pressure, HALF_SUPPLY + state.pressure)
        return Action(inflow=self.gain * jnp.sqrt(jnp.maximum(drop, 1e3)))
