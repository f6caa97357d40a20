"""A spring between two bodies of a machine that grows stiffer as it bends."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, parameter


class SpringHardening(AbstractEffect):
    """F = -k_3 x^3 between the bodies of a joint, or a body and the ground, x apart from rest.

    Signature: the period of a swing shortens (k_3 > 0) or lengthens as it goes farther, and a third
    harmonic appears.
    Siblings: a stiffer spring, where all swings are of one size.
    """

    cubic: Array = parameter(
        "k_cubic",
        r"k_3",
        "N/m^3",
        either_sign(1e9),
        meaning="cubic stiffness of the spring",
        absent=0.0,
    )

    name: ClassVar[str] = "spring-hardening"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "the spring grows stiffer, or softer, the more it bends"
    source: ClassVar[str] = (
        "Duffing 1918, Erzwungene Schwingungen; the first odd term after Hooke's"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("run", "motion")

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return what the spring has beyond Hooke's law."""
        return Action(between=-self.cubic * state.stroke**3)
