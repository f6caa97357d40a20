"""Viscous friction that differs by direction."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, parameter

SWITCH_SPEED = 1e-4
"""Speed [m/s] about which the coefficient changes over: a tenth of the slowest driven sliding."""


class DirectionDependentViscosity(AbstractEffect):
    """F_f = -mu_back v (1 - tanh(v/v_0))/2: beside mu while sliding back, v_0 = 0.1 mm/s.

    The sign is free; mu + mu_back is positive in any rig that stands still when left alone.

    Signature: pressure while oil goes to the tank, in proportion to the speed, and nothing while
    the plunger goes out; in a release the half swings are damped in turns.
    Siblings: mu itself where no record slides back, Coulomb and Stribeck friction (which change
    both ways), kappa to the tank.
    """

    coefficient: Array = parameter(
        "mu_back",
        r"\mu_\mathrm{b}",
        "N s/m",
        either_sign(5e4),
        meaning="excess of the viscous coefficient on the way back",
        absent=0.0,
    )

    name: ClassVar[str] = "direction-dependent-viscosity"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "the viscous coefficient differs by direction"
    source: ClassVar[str] = (
        "paper, eq. (8), with a coefficient for each direction; wiper and lip seals are not "
        "symmetric, Mueller and Nau 1998, Fluid Sealing Technology"
    )

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force against sliding back."""
        back = 0.5 * (1.0 - jnp.tanh(state.slip / SWITCH_SPEED))
        return Action(between=-self.coefficient * state.slip * back)

    def friction(self, omega: Array) -> Array:
        """Return half the coefficient, its describing function at any amplitude."""
        return 0.5 * self.coefficient + jnp.zeros_like(omega, dtype=complex)
