"""A spring between two bodies of a machine."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter


class JointSpring(AbstractEffect):
    """F = -k x between the bodies of a joint, or a body and the ground, x apart from rest.

    Signature: a swing whose period does not depend on how far it goes.
    Siblings: a mass that is off, as long as no force is known.
    """

    stiffness: Array = parameter(
        "k_spring",
        r"k",
        "N/m",
        lognormal(1e5, 30.0),
        meaning="stiffness of the spring",
        absent=0.0,
    )

    name: ClassVar[str] = "joint-spring"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "a spring between the two bodies, or the body and the ground"
    source: ClassVar[str] = "Hooke's law"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("run", "motion")

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force of the spring."""
        return Action(between=-self.stiffness * state.stroke)
