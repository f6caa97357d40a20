"""The elastic end of the cylinder: load cell, stroke sensor and hinge."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter


class LoadCellSpring(AbstractEffect):
    """Spring between root and cylinder: F_LC = -k_LC (x_HC - x_root), the root fixed in (8)."""

    stiffness: Array = parameter(
        "k_LC",
        r"k_\mathrm{LC}",
        "N/m",
        lognormal(6e7, 2.0),
        meaning="stiffness of the load-cell end",
    )

    name: ClassVar[str] = "load-cell-spring"
    equation: ClassVar[str] = "load-cell"
    phrase: ClassVar[str] = "the load-cell end gives way like a spring"
    source: ClassVar[str] = "paper, eq. (8)"
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the spring force, which is what the load cell reads."""
        return Action(load_cell=-self.stiffness * (state.x_cylinder - state.x_root))
