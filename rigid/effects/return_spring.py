"""What pushes the plunger back into the cylinder."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter

STOP_GIVE = 0.2e-3
"""Stroke [m] over which the end stop hands the preload over to the oil: one step of the stroke
sensor, so that the rig is at rest where a record begins and the hand-over is below what is seen."""


class ReturnSpring(AbstractEffect):
    """F = -(F_0 tanh(x/x_0) + k x) between plunger and cylinder, x the stroke, x_0 = 0.2 mm.

    A return spring of preload F_0 and rate k, or a back pressure on the rod side times its area.
    At zero stroke the end stop takes the preload; tanh stays bounded on both sides of it.

    Signature: the pressure of a free run is F_0/S higher from the first millimetre on, the same at
    every speed, and rises with the stroke by k/S; it stays in a hold and does not turn over when
    the plunger turns; load and pressure of a frame part by as much.
    Siblings: viscous and dry friction while the plunger only goes out (a hold or the way back parts
    them), pressure zero (a record from rest parts it), effective area (grows with pressure).
    A release, 0.1 mm of motion away from the stop, does not feel it.
    """

    preload: Array = parameter(
        "F_return",
        r"F_0",
        "N",
        any_size(1e3),
        meaning="force of the return spring at zero stroke",
        absent=0.0,
    )
    rate: Array = parameter(
        "k_return",
        r"k_\mathrm{r}",
        "N/m",
        any_size(5e3),
        meaning="stiffness of the return spring",
        absent=0.0,
    )

    name: ClassVar[str] = "return-spring"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "a spring or a back pressure pushes the plunger back into the cylinder"
    source: ClassVar[str] = (
        "Hooke's law with a preload; the paper's eq. (18) puts all of S p in a free run to "
        "friction and leaves out the rod side"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force of the spring."""
        preload = self.preload * jnp.tanh(state.stroke / STOP_GIVE)
        return Action(between=-(preload + self.rate * state.stroke))
