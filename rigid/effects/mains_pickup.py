"""A line that sensors pick up from the mains, or from a fan or a supply."""

from collections.abc import Mapping
from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, lognormal, parameter


class MainsPickup(AbstractEffect):
    """Each sensor reads a sin(2 pi f t + phi) too much, t since the record began.

    f is one for all. Each sort of sensor has an a of its own, told as that of the load cell and
    ratios to it, and each channel of a record an angle, `pickup_angle_load[record,cylinder]` etc.

    Signature: a line at f in a channel for all of a record, valve open or shut, moving or at rest.
    A line above half the sampling frequency appears at its alias: 50 Hz sampled at 80 Hz at 30 Hz,
    and at 100 Hz as readings that are too high and too low in turn.
    Siblings: pump ripple (a line as well, but while the pump feeds the rig, of one angle, and as
    large in each channel as the flow makes it); two lines whose aliases are one.
    """

    amplitude: Array = parameter(
        "pickup",
        r"a_\mathrm{h}",
        "N",
        any_size(150.0),
        meaning="amplitude of the line that the load cell picks up",
        absent=0.0,
    )
    frequency: Array = parameter(
        "f_pickup",
        r"f_\mathrm{h}",
        "Hz",
        lognormal(50.0, 1.6),
        meaning="frequency of the line that sensors pick up",
    )
    stroke: Array = parameter(
        "pickup_stroke",
        r"r_\mathrm{h,SS}",
        "m/N",
        lognormal(4e-7, 5.0),
        meaning="amplitude of the stroke sensor's line over that of the load cell's",
    )
    pressure: Array = parameter(
        "pickup_pressure",
        r"r_{\mathrm{h},p}",
        "Pa/N",
        lognormal(80.0, 5.0),
        meaning="amplitude of the pressure gauge's line over that of the load cell's",
    )
    acceleration: Array = parameter(
        "pickup_acceleration",
        r"r_{\mathrm{h},a}",
        "m/(s^2 N)",
        lognormal(2.4e-3, 5.0),
        meaning="amplitude of the accelerometer's line over that of the load cell's",
    )

    name: ClassVar[str] = "mains-pickup"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "sensors pick up a line, of the mains or of a machine near by"
    source: ClassVar[str] = (
        "Ott 2009, Electromagnetic Compatibility Engineering, ch. 2: fields of the mains at a "
        "cable; ratios as those of the sensors' noise"
    )
    steady: ClassVar[bool] = True
    beat: ClassVar[str | None] = "f_pickup"
    ratios: ClassVar[Mapping[str, str]] = {
        "stroke": "pickup_stroke",
        "pressure": "pickup_pressure",
        "acceleration": "pickup_acceleration",
    }

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the rig moves as it did."""
        return Action()

    def lines(self) -> Mapping[str, tuple[Array, Array]]:
        """Return each sensor's line."""
        sizes = {"load": 1.0} | {quantity: getattr(self, quantity) for quantity in self.ratios}
        return {q: (self.amplitude * size, self.frequency) for q, size in sizes.items()}
