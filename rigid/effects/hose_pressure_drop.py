"""A gauge that sits upstream of the hose."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import any_size, parameter


class HosePressureDrop(AbstractEffect):
    """The gauge reads p + R q, q the flow through the hose into the chamber.

    One coefficient: the flow is laminar. Through 6.4 mm, 2.4 l/min of oil of 50 cSt have a Reynolds
    number of 160, the whole pump 770, colder oil less; 6 m of such a hose have R = 7e9 Pa s/m^3. A
    part that grows with q^2, from fittings, is left to the residuals.

    Signature: the pressure alone jumps by R q at every switch of the valve, at once, up when it
    opens and down when it shuts, and is read too low while oil goes to the tank; load and stroke
    are as they were. In a free run it is a constant beside the rest.
    Siblings: viscous friction and friction with memory in a free run at one speed (0.94; load and
    stroke part them), clock offset (-0.85: both act on the pressure at the switches), pressure
    zero while the valve is open.
    """

    resistance: Array = parameter(
        "R_hose",
        r"R_\mathrm{h}",
        "Pa s/m^3",
        any_size(5e9),
        meaning="pressure drop of the hose per flow",
        absent=0.0,
    )

    name: ClassVar[str] = "hose-pressure-drop"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = (
        "the gauge sits before the hose and reads the pressure in the cylinder "
        "plus a drop that grows with the flow"
    )
    source: ClassVar[str] = "Hagen-Poiseuille, R = 128 eta L/(pi d^4)"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: it acts on the gauge alone."""
        return Action()

    def sense(self, seen: Seen) -> Distortion:
        """Return the drop along the hose."""
        return Distortion(pressure=self.resistance * seen.inflow)
