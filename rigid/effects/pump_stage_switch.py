"""A pump that goes over to its slow stage early."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import (
    AbstractEffect,
    Action,
    State,
    parameter,
    truncated_normal,
    uniform,
)
from rigid.effects.pump_curve import HALF_DROP, STEEPNESS


class PumpStageSwitch(AbstractEffect):
    """q loses d (q_fast - q_slow) (1 + tanh(b (p - p_s)))/2: the slow stage from p_s on.

    q_fast - q_slow = 9.93 l/min and b = 0.05 per bar are those of eq. (22), to which it is added;
    d is the share of the paper's drop, 1 within some percent. It is meant for p_s below p_max and
    pressures below p_max: beyond, eq. (22) would fall a second time.

    Signature: at one pressure, the same in every record, the rise of load, stroke and pressure
    breaks to a seventh of its speed; nothing happens in a hold; on unloading the break comes back
    only with the pump running.
    Siblings: load-cell stiffening (-0.91), piston leakage, a valve event (which stands at one time,
    not at one pressure), kappa where a record stays on one side of p_s.
    """

    drop: Array = parameter(
        "stage_drop", r"d_\mathrm{s}", "1", truncated_normal(1.0, 0.05, 0.0, 1.15), absent=0.0
    )
    pressure: Array = parameter("p_stage", r"p_\mathrm{s}", "Pa", uniform(100e5, 700e5))

    name: ClassVar[str] = "pump-stage-switch"
    equation: ClassVar[str] = "pump"
    source: ClassVar[str] = (
        "paper, Construction of the hydraulic rig: the fast stage serves loads below 60 kN a "
        "cylinder, 136 bar, where eq. (22) has 700 bar (the prior: anything between); flows and "
        "steepness of eq. (22)"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("frame", "free-run", "field")
    threshold: ClassVar[str | None] = "p_stage"

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow that the slow stage lacks."""
        above = 1.0 + jnp.tanh(STEEPNESS * (state.pressure - self.pressure))
        return Action(inflow=-self.drop * HALF_DROP * above)
