"""A pressure gauge that follows late."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import any_size, parameter
from rigid.effects.low_pass import following


class PressureGaugeLag(AbstractEffect):
    """First-order lag: the gauge reads p - tau (p - w)/T, T dw/dt = p - w, T^2 = tau^2 + (1 ms)^2.

    With T = tau it reads w, a low pass of the pressure; the millisecond keeps it regular down to
    tau = 0, where nothing lags.

    Signature: the pressure alone is tau dp/dt short on every slope, and corners at a switch of the
    valve are round; a hold that is at rest does not show it.
    Siblings: a clock offset (the same on slopes, but corners are sharp and late), hose pressure
    drop (a step while the valve is open), entrained air (the load is late too).
    """

    time: Array = parameter(
        "tau_gauge",
        r"\tau_p",
        "s",
        any_size(0.03),
        meaning="time constant of the pressure gauge",
        absent=0.0,
    )

    name: ClassVar[str] = "pressure-gauge-lag"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the pressure gauge follows late"
    source: ClassVar[str] = (
        "first-order low pass: oil that fills the gauge through a narrow line, or the amplifier's"
    )
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1e7,)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return how the filtered pressure follows that of the chamber."""
        return Action(rates=(following(state.pressure, own[0], self.time),))

    def sense(self, seen: Seen) -> Distortion:
        """Return how far the gauge is behind."""
        behind = following(seen.state.pressure, seen.own[0], self.time)
        return Distortion(pressure=-self.time * behind)
