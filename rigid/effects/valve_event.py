"""A valve that stands elsewhere for a while."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, lognormal, parameter, uniform
from rigid.effects.pump_curve import HALF_DROP, MEAN_FLOW


class ValveEvent(AbstractEffect):
    """kappa becomes r kappa from t_e to t_e + d: q gains (r - 1) q_fast w(t).

    w = (tanh((t - t_e)/e) - tanh((t - t_e - d)/e))/2, t since the record began. A valve turned by
    hand takes a while: a change is over within four times e.
    The change is relative to the fast stage's flow, which the pump delivers below p_max.

    Signature: in one record, for a stretch of time, load, stroke and pressure rise r times as fast
    (in a free run the pressure steps by (r - 1) mu v/S as well); afterwards load and stroke keep
    what was gained or lost. Other records know nothing of it.
    Siblings: pump stage switch (which stands at one pressure and in every record), kappa where the
    event is as long as the record, a wrong instant of the valve where it is at a switch.
    """

    size: Array = parameter(
        "event_size",
        r"\ln r_\mathrm{e}",
        "1",
        either_sign(0.3),
        meaning="log of the factor on the flow that the valve passes",
        absent=0.0,
    )
    start: Array = parameter(
        "event_start",
        r"t_\mathrm{e}",
        "s",
        uniform(0.0, 10.0),
        meaning="time at which the event begins",
    )
    duration: Array = parameter(
        "event_duration", r"d_\mathrm{e}", "s", lognormal(0.7, 2.0), meaning="duration of the event"
    )
    edge: Array = parameter(
        "event_edge",
        r"e_\mathrm{e}",
        "s",
        lognormal(0.07, 2.0),
        meaning="time scale on which the valve moves",
    )

    name: ClassVar[str] = "valve-event"
    equation: ClassVar[str] = "pump"
    phrase: ClassVar[str] = (
        "for a stretch of one record the valve passes another fraction of the flow"
    )
    source: ClassVar[str] = (
        "paper, eq. (4): kappa depends on time; Numerical simulations: the valve of cylinder B was "
        "moved by hand during the test"
    )
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow that the valve lets through more."""
        since = state.time - self.start
        within = jnp.tanh(since / self.edge) - jnp.tanh((since - self.duration) / self.edge)
        return Action(inflow=0.5 * jnp.expm1(self.size) * (MEAN_FLOW + HALF_DROP) * within)
