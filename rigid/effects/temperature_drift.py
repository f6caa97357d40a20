"""Sensors that warm up."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import either_sign, lognormal, normal, parameter


class TemperatureDrift(AbstractEffect):
    """Load and pressure are read with A g and A r g beside them, T dg/dt = 1 - g.

    g is 0 where a record begins, 1 - exp(-t/T) later. r is the gauge's drift over the load cell's;
    where both take the same share of their ranges it is near 1/S_Pl, 230 Pa/N.

    Signature: in every record load and pressure leave the stroke behind together, first fast, then
    slower, whether the valve is open or shut.
    Siblings: load-cell drift (the load alone, in proportion to time), leakage of the piston (stroke
    goes along), friction in a free run.
    """

    force: Array = parameter(
        "thermal_load",
        r"A_\vartheta",
        "N",
        either_sign(300.0),
        meaning="what the load cell's zero moves by as it warms up",
        absent=0.0,
    )
    ratio: Array = parameter(
        "thermal_ratio",
        r"r_\vartheta",
        "Pa/N",
        normal(0.0, 250.0),
        meaning="drift of the pressure gauge over that of the load cell",
    )
    time: Array = parameter(
        "tau_thermal",
        r"\tau_\vartheta",
        "s",
        lognormal(15.0, 4.0),
        meaning="time in which the sensors warm up",
    )

    name: ClassVar[str] = "temperature-drift"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "load cell and pressure gauge drift together as they warm up"
    source: ClassVar[str] = (
        "a body that takes on another temperature, to first order (Newton's cooling), and zeros in "
        "proportion to it, as data sheets state them per kelvin"
    )
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1.0,)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return how fast the sensors warm up."""
        return Action(rates=((1.0 - own[0]) / self.time,))

    def sense(self, seen: Seen) -> Distortion:
        """Return how far both zeros have moved."""
        moved = self.force * seen.own[0]
        return Distortion(load=moved, pressure=self.ratio * moved)
