"""A force and a position, of one motion, that do not share their time zero."""

from collections.abc import Mapping
from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, parameter


class ForceClockOffset(AbstractEffect):
    """The force on record at t is what it was at t - d; position and pressure are on time.

    Signature: the force is off by d dF/dt. In a swing at omega a part d omega of the spring's force
    looks like drag, and one of a damper's like mass.
    Siblings: viscous friction and mass, where all swings are at one frequency.
    """

    delay: Array = parameter(
        "force_delay",
        r"d_F",
        "s",
        either_sign(0.01),
        meaning="delay of the force's time stamps",
        absent=0.0,
    )

    name: ClassVar[str] = "force-clock-offset"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "time stamps of the force are shifted against those of the position"
    source: ClassVar[str] = (
        "two loggers, or a filter in one amplifier alone: the paper's rig has a field computer and "
        "a CR6 logger (Construction of the hydraulic rig)"
    )
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("motion",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the body takes the force that it took."""
        return Action()

    def delays(self) -> Mapping[str, Array]:
        """Return by how much the force lags."""
        return {"force": self.delay}
