"""Channels that do not share their time zero."""

from collections.abc import Mapping
from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, parameter


class ClockOffset(AbstractEffect):
    """The pressure on record at t is what it was at t - d; load and stroke are on time.

    Signature: the pressure alone is late by d at every corner, by d dp/dt on every slope; a hold
    that is at rest does not show it.
    Siblings: hose pressure drop (-0.85: both act on the pressure while the valve is open), lag of
    the stroke sensor where the pressure hardly moves, entrained air (the load is late too).
    """

    delay: Array = parameter(
        "pressure_delay",
        r"d_p",
        "s",
        either_sign(0.02),
        meaning="delay of the pressure's time stamps",
        absent=0.0,
    )

    name: ClassVar[str] = "clock-offset"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the pressure's time stamps are shifted against the others"
    source: ClassVar[str] = (
        "paper, Construction of the hydraulic rig: a field computer and a CR6 logger both record"
    )
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the rig moves as it did."""
        return Action()

    def delays(self) -> Mapping[str, Array]:
        """Return by how much the pressure lags."""
        return {"pressure": self.delay}
