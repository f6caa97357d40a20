"""Oil that passes the piston."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter


class PistonLeakage(AbstractEffect):
    """Laminar flow out of the chamber past the piston: q_leak = C p.

    Signature: in a hold under a shut valve pressure, load and stroke fall exponentially together,
    with the time constant (S^2/k + V/k_oil)/C, k the springs of load cell and frame in series;
    under the pump the rise slows with pressure.
    Siblings: kappa, while the pump runs; pump stage switch (a step of the rise at one pressure, no
    fall in a hold); load-cell drift (load alone moves); leakage of the shut valve (0.998: under the
    pump nothing is lost, which long pumping alone shows).
    """

    conductance: Array = parameter(
        "C_leak",
        r"C_\mathrm{leak}",
        "m^3/(s Pa)",
        any_size(3e-15),
        meaning="leakage per pressure",
        absent=0.0,
    )

    name: ClassVar[str] = "piston-leakage"
    equation: ClassVar[str] = "oil-balance"
    phrase: ClassVar[str] = "oil leaks past the piston, in proportion to the pressure"
    source: ClassVar[str] = "Merritt 1967, Hydraulic Control Systems, ch. 6, leakage coefficient"
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the leakage."""
        return Action(leakage=self.conductance * state.pressure)
