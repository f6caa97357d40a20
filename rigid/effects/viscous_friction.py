"""Friction proportional to the sliding speed."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import STEADY_FRICTION, lognormal, parameter


class ViscousFriction(AbstractEffect):
    """Friction F_f = -mu v_SS on the plunger; beside branches with memory, mu is the rest."""

    coefficient: Array = parameter(
        "mu",
        r"\mu",
        "N s/m",
        lognormal(1e5, 10.0),
        meaning="viscous friction coefficient",
        absent=0.0,
        part_of=STEADY_FRICTION,
    )

    name: ClassVar[str] = "viscous-friction"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "friction in proportion to the speed between plunger and cylinder"
    source: ClassVar[str] = "paper, eq. (8)"
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force against the sliding."""
        return Action(between=-self.coefficient * state.slip)

    def friction(self, omega: Array) -> Array:
        """Return the same coefficient at every frequency."""
        return self.coefficient + jnp.zeros_like(omega, dtype=complex)
