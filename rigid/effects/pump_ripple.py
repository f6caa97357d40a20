"""The beat of the pump."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, lognormal, parameter
from rigid.effects.pump_curve import HALF_DROP, MEAN_FLOW


class PumpRipple(AbstractEffect):
    """q gains a q_fast sin(2 pi f t + phi), t since the record began.

    a is relative to the fast stage's flow, 11.6 l/min, which the pump delivers below p_max. The
    pump runs at one speed; at which angle phi it stood when a record began is a number of that
    record's own, `pump_angle[record]`.

    Signature: with the valve open, a line at f in pressure and load, an amplitude a kappa q_fast /
    (2 pi f) of oil over the rig's compliance in a frame, mu a v/S in a free run; none with the
    valve shut, nor on the way to the tank, which passes no pump. The stroke follows below its step.
    Siblings: none in a frame; in a free run an oscillation of the rig itself (which dies out).
    A line above half the sampling frequency appears at its alias.
    """

    amplitude: Array = parameter(
        "ripple",
        r"a_\mathrm{r}",
        "1",
        any_size(0.03),
        meaning="amplitude of the ripple as a share of the pump's flow",
        absent=0.0,
    )
    frequency: Array = parameter(
        "f_ripple", r"f_\mathrm{r}", "Hz", lognormal(8.0, 2.0), meaning="frequency of the ripple"
    )

    name: ClassVar[str] = "pump-ripple"
    equation: ClassVar[str] = "pump"
    phrase: ClassVar[str] = "a periodic part of the pump's flow"
    source: ClassVar[str] = (
        "first harmonic of a periodic delivery; Merritt 1967, ch. 4, pump ripple"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)
    beat: ClassVar[str | None] = "f_ripple"

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the periodic part of the flow."""
        beat = jnp.sin(2.0 * jnp.pi * self.frequency * state.time + state.pump_angle)
        return Action(inflow=self.amplitude * (MEAN_FLOW + HALF_DROP) * beat * state.pumped)
