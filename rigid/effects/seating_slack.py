"""Play before the plate is seated in the frame."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter

TOE = 5e-6
"""Length [m] over which a seat without slack would close, a part of what a pump that feeds a frame
moves the plunger between two samples. It gives the force a slope also where the slack is 0."""
LEAST = 0.05
"""Share by which the toe is longer than the slack; it leaves about that share of k_frame at once.
With less, the integrator's steps would pass the toe of a long slack too fast."""


class SeatingSlack(AbstractEffect):
    """The frame takes k_frame (x - s tanh(x/(1.05 s + e))), x the plunger's place, e = 5 um.

    The frame's stiffness grows from nearly nothing to k_frame over a toe of about the slack s, and
    the force is as if the frame stood back by s from there on. At s = 0 it is k_frame x.

    Signature: in a frame load and pressure set in late and along a foot, while the stroke runs
    ahead by s; the foot comes back on unloading. Nothing in other records.
    Siblings: entrained air (0.97: the same foot in time, without the stroke that runs ahead, and
    also in free runs and releases), load-cell stiffening, the zero of the stroke sensor once
    the foot is past.
    """

    slack: Array = parameter(
        "slack", r"s", "m", any_size(3e-4), meaning="travel until the plate is seated", absent=0.0
    )

    name: ClassVar[str] = "seating-slack"
    equation: ClassVar[str] = "contact"
    finer: ClassVar[int] = 2  # a joint that opens changes the motion within a step
    phrase: ClassVar[str] = (
        "clearance or a soft seat is taken up before the plate is in full contact"
    )
    source: ClassVar[str] = (
        "paper, Calibration experiments: force against stroke is straight beyond 1 mm, which is "
        "taken as an offset; the form of the toe is a choice"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("frame",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force that the frame does not take yet."""
        missing = self.slack * jnp.tanh(state.x_plunger / ((1.0 + LEAST) * self.slack + TOE))
        return Action(on_plunger=state.contact_stiffness * missing)
