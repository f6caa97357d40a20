"""Free gas in the oil."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter

ATMOSPHERE = 101325.0  # Pa
FLOOR = 1e4
"""Absolute pressure [Pa] about which the gas law is rounded off, so that the gas stays finite where
the model's oil would go below vacuum: there it is a cavity that grows at hardly any pressure."""


class EntrainedAir(AbstractEffect):
    """Gas of volume fraction alpha at atmospheric pressure p_a: 1/k = 1/k_oil + alpha p_a/P^2.

    P is the absolute pressure, p + p_a, rounded off near vacuum: P = (a + sqrt(a^2 + 4 e^2))/2 with
    a = p + p_a and e = 0.1 bar. The gas is isothermal (bubbles below a millimetre follow the oil's
    temperature within a tenth of a second); in a release it would be up to 1.4 times as stiff.

    Signature: in a frame load, pressure and stroke set in late together, by the time the pump takes
    to fill the gas's volume alpha V, along a foot that straightens within some 10 bar and comes
    back on unloading; in a free run, whose pressure stays low, the stroke is short by what is
    squeezed. In a release the swing into low pressure is long, that into high pressure short.
    Siblings: seating slack (0.97: the same foot, but the stroke runs ahead by the slack), clock
    offset of load and pressure, a wrong instant of the valve.
    """

    fraction: Array = parameter(
        "air_fraction",
        r"\alpha_\mathrm{a}",
        "1",
        any_size(2e-3),
        meaning="share of air in the oil at atmospheric pressure",
        absent=0.0,
    )

    name: ClassVar[str] = "entrained-air"
    equation: ClassVar[str] = "oil-balance"
    softens: ClassVar[bool] = True
    phrase: ClassVar[str] = "air in the oil makes it softer at low pressure"
    source: ClassVar[str] = (
        "Merritt 1967, Hydraulic Control Systems, ch. 2; Gholizadeh, Burton and Schoenau 2011, "
        "Fluid bulk modulus: a literature survey, Int. J. Fluid Power 12(3); here isothermal"
    )

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the compliance of the gas."""
        above_vacuum = state.pressure + ATMOSPHERE
        absolute = 0.5 * (above_vacuum + jnp.sqrt(above_vacuum**2 + 4.0 * FLOOR**2))
        return Action(compliance=self.fraction * ATMOSPHERE / absolute**2)
