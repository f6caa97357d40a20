"""A stroke sensor that follows late."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import any_size, parameter
from rigid.effects.low_pass import following


class StrokeSensorLag(AbstractEffect):
    """First-order lag: the sensor reads x - tau u, with T du/dt = v_SS - u, T^2 = tau^2 + (1 ms)^2.

    With T = tau that is tau dr/dt = x - r for the reading r; the millisecond keeps it regular down
    to tau = 0, where nothing lags, and counts for half a percent of T at tau = 10 ms.

    Signature: the stroke alone is tau v short while the plunger slides, and catches up within some
    tau once it stops; at 10 mm/s and 30 ms that is 0.3 mm, a step and a half.
    Siblings: a clock offset of the stroke (the same while sliding; the corner at a switch is round
    in a lag, sharp in an offset), the stroke's zero in a free run at one speed.
    """

    time: Array = parameter(
        "tau_stroke",
        r"\tau_\mathrm{SS}",
        "s",
        any_size(0.03),
        meaning="time constant of the stroke sensor",
        absent=0.0,
    )

    name: ClassVar[str] = "stroke-sensor-lag"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the stroke sensor follows late"
    source: ClassVar[str] = "first-order low pass, as signal conditioners have it"
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1e-2,)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return how the filtered speed follows that of the plunger."""
        return Action(rates=(following(state.slip, own[0], self.time),))

    def sense(self, seen: Seen) -> Distortion:
        """Return how far the sensor is behind."""
        return Distortion(stroke=-self.time * seen.own[0])
