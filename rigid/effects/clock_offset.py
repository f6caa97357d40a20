"""Channels that do not share their time zero."""

from collections.abc import Mapping
from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, normal, parameter


class ClockOffset(AbstractEffect):
    """The pressure on record at t is what it was at t - d, the load what it was at t - r d.

    The stroke is on time. r is 0 where the load is recorded with the stroke, 1 where it is with the
    pressure.

    Signature: pressure, and load in as far as r is not 0, are late at every corner, by d dp/dt and
    r d dF/dt on every slope; a hold that is at rest does not show it.
    Siblings: hose pressure drop (-0.85 where r is 0: both act on the pressure while the valve is
    open), lag of the stroke sensor where the pressure hardly moves, entrained air (pressure and
    load are late, and the stroke too).
    """

    delay: Array = parameter(
        "pressure_delay",
        r"d_p",
        "s",
        either_sign(0.02),
        meaning="delay of the pressure's time stamps",
        absent=0.0,
    )
    load_share: Array = parameter(
        "load_delay_ratio",
        r"r_F",
        "1",
        normal(0.5, 0.5),
        meaning="delay of the load's time stamps over that of the pressure's",
    )

    name: ClassVar[str] = "clock-offset"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "time stamps of pressure, or of load and pressure, are shifted"
    source: ClassVar[str] = (
        "paper, Construction of the hydraulic rig: a field computer and a CR6 logger both record"
    )
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the rig moves as it did."""
        return Action()

    def delays(self) -> Mapping[str, Array]:
        """Return by how much load and pressure lag."""
        return {"load": self.load_share * self.delay, "pressure": self.delay}
