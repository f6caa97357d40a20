"""Converters that average over a part of the sampling interval."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter, uniform


class SampleAveraging(AbstractEffect):
    """A reading is r + s (m - r), m the mean over a share w of the interval, about its instant.

    A converter that averages, or integrates for as long, has s = 1; a filter before it that is
    quicker or slower looks like another w, and one that comes late as a clock offset of all
    channels as well.

    Signature: nothing on straight slopes, s w h/8 times the change of the slope at a corner (h the
    sampling interval), and half of a jump that falls on a sample, in every channel.
    Siblings: a clock offset (one side of a corner alone, the pressure alone), lag of a gauge
    (slopes as well).
    """

    share: Array = parameter(
        "averaged",
        r"s_\mathrm{av}",
        "1",
        any_size(1.0),
        meaning="share of each reading that is a mean about its instant",
        absent=0.0,
    )
    width: Array = parameter(
        "aperture",
        r"w_\mathrm{av}",
        "1",
        uniform(0.05, 1.0),
        meaning="share of the sampling interval over which readings are means",
    )

    name: ClassVar[str] = "sample-averaging"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "readings are means over a part of the sampling interval"
    source: ClassVar[str] = (
        "IEEE Std 1241, Terminology and Test Methods for Analog-to-Digital Converters: aperture; "
        "converters that integrate, as data loggers have them"
    )
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the rig moves as it did."""
        return Action()

    def averaging(self) -> tuple[Array, Array]:
        """Return share and width."""
        return self.share, self.width
