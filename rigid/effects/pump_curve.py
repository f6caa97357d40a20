"""What the pump delivers at a given pressure."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import fixed, parameter

LITRE_PER_MINUTE = 1e-3 / 60.0  # m^3/s
MEAN_FLOW = 6.645 * LITRE_PER_MINUTE  # eq. (22)
HALF_DROP = 4.965 * LITRE_PER_MINUTE  # eq. (22)
STEEPNESS = 0.05e-5  # 1/Pa; eq. (22) has 0.05 per bar


class PumpCurve(AbstractEffect):
    """Flow of the two-stage pump, fast below p_max and slow above."""

    switch_pressure: Array = parameter(
        "p_max",
        r"p_\mathrm{max}",
        "Pa",
        fixed(700e5),
        meaning="pressure at which the pump changes its stage by eq. (22)",
    )

    name: ClassVar[str] = "pump-curve"
    equation: ClassVar[str] = "pump"
    phrase: ClassVar[str] = "the pump delivers less at high pressure"
    source: ClassVar[str] = "paper, eq. (22) as printed, pressures in bar there"
    steady: ClassVar[bool] = True
    exact: ClassVar[str] = "what the pump delivers at each pressure, of which kappa is the fraction"

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow of the pump with the valve fully open."""
        above = STEEPNESS * (state.pressure - self.switch_pressure)
        return Action(inflow=MEAN_FLOW - HALF_DROP * jnp.tanh(above))
