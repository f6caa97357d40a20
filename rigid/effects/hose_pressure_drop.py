"""A gauge that sits upstream of the hose."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import any_size, lognormal, parameter


class HosePressureDrop(AbstractEffect):
    """The gauge reads p + R q (1 + |q|/q_f), q the flow through the hose into the chamber.

    In the hose the flow is laminar: through 6.4 mm, 2.4 l/min of oil of 50 cSt have a Reynolds
    number of 160, the whole pump 770, colder oil less; 6 m of such a hose have R = 7e9 Pa s/m^3.
    What is narrow and short, a fitting or a coupling that does not open all the way, takes a part
    that grows with the square and is as much as that of the hose at the flow q_f. An orifice of
    2 mm takes 1e14 Pa s^2/m^6 times q^2: as much as that hose at 4 l/min.

    Signature: the pressure alone jumps by the drop where the valve switches, at once, up when it
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

    fittings: Array = parameter(
        "q_fittings",
        r"q_\mathrm{f}",
        "m^3/s",
        lognormal(1e-4, 10.0),
        meaning="flow at which fittings take as much as the hose",
    )

    name: ClassVar[str] = "hose-pressure-drop"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = (
        "the gauge sits before the hose and reads the pressure in the cylinder "
        "plus a drop that grows with the flow"
    )
    source: ClassVar[str] = (
        "Hagen-Poiseuille, R = 128 eta L/(pi d^4); orifice, rho q^2/(2 (C_d A)^2), Merritt 1967"
    )
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: it acts on the gauge alone."""
        return Action()

    def sense(self, seen: Seen) -> Distortion:
        """Return the drop along hose and fittings."""
        more = 1.0 + jnp.abs(seen.inflow) / self.fittings
        return Distortion(pressure=self.resistance * seen.inflow * more)
