"""A pump that goes over to its slow stage early."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter, truncated_normal, uniform
from rigid.effects.pump_curve import HALF_DROP, STEEPNESS


class PumpStageSwitch(AbstractEffect):
    """q loses d (q_fast - q_slow) (1 + tanh((p - p_s)/w))/2: the slow stage from p_s on.

    q_fast - q_slow = 9.93 l/min is that of eq. (22), to which it is added; d is the share of the
    paper's drop. It is 1 within some percent for the paper's pump; what passes the unloading valve
    of another may leave it at 0.8. The paper has w = 20 bar (0.05 per bar) and says not where
    from; records that just reach p_s see the foot of the switch alone, whose slope is that of w:
    it counts as known to a factor of two. It is meant for p_s below p_max and pressures below
    p_max: beyond, eq. (22) would fall a second time. What flows to the tank passes no pump.

    Signature: at one pressure, the same in every record, the rise of load, stroke and pressure
    breaks to a seventh of its speed; nothing happens in a hold or on unloading.
    Siblings: load-cell stiffening (-0.91), piston leakage, a valve event (which stands at one time,
    not at one pressure), kappa where a record stays on one side of p_s.
    """

    drop: Array = parameter(
        "stage_drop",
        r"d_\mathrm{s}",
        "1",
        truncated_normal(1.0, 0.15, 0.0, 1.15),
        meaning="share of the drop between the pump's stages",
        absent=0.0,
    )
    pressure: Array = parameter(
        "p_stage",
        r"p_\mathrm{s}",
        "Pa",
        uniform(100e5, 700e5),
        meaning="pressure at which the pump changes its stage",
    )
    width: Array = parameter(
        "stage_width",
        r"w_\mathrm{s}",
        "Pa",
        lognormal(1.0 / STEEPNESS, 2.0),
        meaning="range of pressure over which the stage changes",
    )

    name: ClassVar[str] = "pump-stage-switch"
    equation: ClassVar[str] = "pump"
    phrase: ClassVar[str] = "the pump changes to its slow stage earlier than its curve says"
    source: ClassVar[str] = (
        "paper, Construction of the hydraulic rig: the fast stage serves loads below 60 kN a "
        "cylinder, 136 bar, where eq. (22) has 700 bar (the prior: anything between); flows and "
        "width of eq. (22)"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)
    threshold: ClassVar[str | None] = "p_stage"

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow that the slow stage lacks."""
        above = 1.0 + jnp.tanh((state.pressure - self.pressure) / self.width)
        return Action(inflow=-self.drop * HALF_DROP * above * state.pumped)
