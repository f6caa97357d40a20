"""A pump that delivers less against pressure."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter
from rigid.effects.pump_curve import HALF_DROP, MEAN_FLOW


class PumpSlip(AbstractEffect):
    """q loses c p (q_mean + q_half), a share c p of the fast stage's flow in eq. (22).

    Two causes are alike in it. Oil leaks back inside the pump. And the pump's volume counts at its
    intake, as (4) can be read: under pressure a volume q is q exp(-p/k_oil), which is c = 1/k_oil =
    5e-10 per Pa, 1.5 % at 300 bar. What flows to the tank passes no pump.

    Signature: under the pump the rise of load, stroke and pressure slows as the pressure grows;
    nothing happens in a hold or on unloading, and little at low pressure.
    Siblings: piston leakage, and a modulus k_oil that is lower (both act in holds and on unloading
    as well); kappa where all pressures are alike; a pump stage switch, of whose rise it may be the
    foot.
    """

    slip: Array = parameter(
        "pump_slip",
        r"c_\mathrm{p}",
        "1/Pa",
        any_size(1e-9),
        meaning="share of the pump's flow that is lost per pressure",
        absent=0.0,
    )

    name: ClassVar[str] = "pump-slip"
    equation: ClassVar[str] = "pump"
    phrase: ClassVar[str] = "the pump delivers less against pressure than its curve says"
    source: ClassVar[str] = (
        "paper, eq. (4), with the volume at the intake; Merritt 1967, Hydraulic Control Systems, "
        "ch. 4, leakage of pumps"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow that is lost."""
        lost = self.slip * state.pressure * (MEAN_FLOW + HALF_DROP)
        return Action(inflow=-lost * state.pumped)
