"""The oil on the rod side of the piston, shut in as well."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter

BORE_AREA = 44.2e-4  # m^2; S_Pl, paper, eq. (1)
ROD_AREA = 3.141592653589793 * 0.05**2 / 4  # m^2; plunger of 5 cm, "Construction"
ANNULUS = BORE_AREA - ROD_AREA
OIL = 2e9  # Pa; paper, eq. (1)


class RodSideChamber(AbstractEffect):
    """A second oil spring: F = -k_oil S_rod/L_rod (x_SS), S_rod = 24.6 cm2 of a bore of 44.2 cm2.

    The rig is double-acting, with two hoses for each cylinder; with both valves shut the rod side
    holds oil of its own. It is linear, so that the eigenvalues at rest are all there is to it.
    """

    column: Array = parameter("L_rod", r"L_\mathrm{rod}", "m", lognormal(0.2, 1.5))

    name: ClassVar[str] = "rod-side-chamber"
    equation: ClassVar[str] = "oil-balance"
    source: ClassVar[str] = "paper, Construction: two hoses, plunger of 5 cm; eq. (9) for its oil"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("release",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force of the oil on the rod side."""
        return Action(between=-OIL * ANNULUS / self.column * state.stroke)
