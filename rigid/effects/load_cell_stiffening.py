"""An elastic end that grows stiffer with load."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter


class LoadCellStiffening(AbstractEffect):
    """F_LC = -(k_LC + k' |u|/2) u with u = x_HC - x_root: the stiffness grows by k' per length.

    k' is how much the tangent stiffness k_LC + k' |u| grows per length of deflection, beside
    k_LC at no load. It is positive: contacts and hinges close under load. 60 kN press the end in
    by 1 mm, where a usual k' (one sd above the prior's median) makes it a tenth stiffer.

    Signature: load against stroke in a frame bends upward, loading and unloading alike, with
    pressure and load together; load and pressure rise the faster the higher they are.
    Siblings: pump stage switch (-0.91 in time; load against stroke parts them), seating slack and
    entrained air at low load, k_LC itself where all records reach the same load.
    """

    growth: Array = parameter(
        "k_stiffening",
        r"k'_\mathrm{LC}",
        "N/m^2",
        any_size(6e9),
        meaning="growth of the stiffness of the load-cell end with its deflection",
        absent=0.0,
    )

    name: ClassVar[str] = "load-cell-stiffening"
    equation: ClassVar[str] = "load-cell"
    phrase: ClassVar[str] = "the load-cell end grows stiffer with load"
    source: ClassVar[str] = (
        "paper, Fig. 6: force against stroke is straight beyond 1 mm only; the next term of eq. (8)"
    )

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force beyond that of the linear spring."""
        deflection = state.x_cylinder - state.x_root
        return Action(load_cell=-0.5 * self.growth * jnp.abs(deflection) * deflection)
