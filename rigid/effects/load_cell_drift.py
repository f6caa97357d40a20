"""A load cell whose zero moves."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import either_sign, parameter


class LoadCellDrift(AbstractEffect):
    """The load is read with D t beside it, t since the record began.

    The drift so far is a state of its own, dd/dt = D, which every solver carries exactly.

    Signature: load alone leaves pressure and stroke behind, in proportion to time, whether the
    valve is open or shut, in a free run as in a hold.
    Siblings: piston leakage (pressure and stroke go along), a return spring in a free run (the
    pressure rises, and with the stroke), the load cell's gain where load grows all the time.
    """

    rate: Array = parameter(
        "load_drift",
        r"D",
        "N/s",
        either_sign(15.0),
        meaning="drift of the load cell's zero",
        absent=0.0,
    )

    name: ClassVar[str] = "load-cell-drift"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the load cell's zero moves with time"
    source: ClassVar[str] = "first term in time of a zero that follows the cell's temperature"
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1e2,)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return how fast the zero moves."""
        return Action(rates=(self.rate + jnp.zeros_like(own[0]),))

    def sense(self, seen: Seen) -> Distortion:
        """Return how far the zero has moved."""
        return Distortion(load=seen.own[0])
