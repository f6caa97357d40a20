"""An accelerometer that swings on its mounting."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import any_size, lognormal, parameter


class AccelerometerResonance(AbstractEffect):
    """A share s of the acceleration a is read through the mounting: a + s (r - a).

    r + 2 zeta r'/w + r''/w^2 = a, w = 2 pi f. States are the same filter of the plate's speed and
    its rate, which is r. A mounting that all of the signal goes through has s = 1.

    Signature: after a release the acceleration alone overshoots and rings at f about what the plate
    does; far below f it is read (w_plate/w)^2 too large.
    Siblings: the rig's own ringing on the load-cell end (which stroke and load share), the
    accelerometer's gain where f is far above what the plate does.
    """

    share: Array = parameter(
        "mounting",
        r"s_\mathrm{m}",
        "1",
        any_size(1.0),
        meaning="share of the acceleration that comes through a mounting that swings",
        absent=0.0,
    )
    frequency: Array = parameter(
        "f_mounting",
        r"f_\mathrm{m}",
        "Hz",
        lognormal(600.0, 2.5),
        meaning="natural frequency of the accelerometer on its mounting",
    )
    damping: Array = parameter(
        "zeta_mounting",
        r"\zeta_\mathrm{m}",
        "1",
        lognormal(0.07, 2.0),
        meaning="damping ratio of the accelerometer on its mounting",
    )

    name: ClassVar[str] = "accelerometer-resonance"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the accelerometer swings on its mounting"
    source: ClassVar[str] = (
        "ISO 5348, Mechanical mounting of accelerometers: a mounted accelerometer is a mass on a "
        "spring"
    )
    steady: ClassVar[bool] = True
    finer: ClassVar[int] = 16  # it swings nearly as fast as it is sampled
    scales: ClassVar[tuple[float, ...]] = (0.1, 100.0)
    kinds: ClassVar[tuple[str, ...] | None] = ("release",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return how the filtered speed follows the plate's."""
        speed, rate = own
        turn = 2.0 * jnp.pi * self.frequency
        behind = state.v_plunger - speed
        return Action(rates=(rate, turn * (turn * behind - 2.0 * self.damping * rate)))

    def sense(self, seen: Seen) -> Distortion:
        """Return what the mounting adds."""
        return Distortion(acceleration=self.share * (seen.own[1] - seen.acceleration))
