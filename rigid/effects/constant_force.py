"""A force that is always there."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import MOTION, AbstractEffect, Action, State
from rigid.effects.declare import either_sign, parameter


class ConstantForce(AbstractEffect):
    """Constant force F on plunger and plate from outside, positive toward the ice.

    Weight of a rig that hangs askew, pull of the suspension or of a hose.

    Signature: where the plate is free, pressure is lower by F/S and load by F, the same at all
    times; a frame carries the force itself, and the stroke at a load is longer by F/k_frame.
    Siblings: the zeros of load cell and gauge (100 N and 0.25 bar, 110 N on the piston), a return
    spring that is all preload (which leaves the load in a frame alone), Coulomb friction while the
    plunger only goes out (load as before).
    A release swings about another place of rest, with the same acceleration.
    """

    force: Array = parameter(
        "F_constant",
        r"F_\mathrm{c}",
        "N",
        either_sign(500.0),
        meaning="constant force on the plunger",
        absent=0.0,
    )

    name: ClassVar[str] = "constant-force"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "a constant force on the plunger"
    source: ClassVar[str] = "paper, eq. (3), with a constant beside F_Ice"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", MOTION)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force."""
        return Action(on_plunger=self.force + jnp.zeros_like(state.x_plunger))
