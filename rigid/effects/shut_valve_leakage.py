"""A valve that shuts badly."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import any_size, parameter


class ShutValveLeakage(AbstractEffect):
    """Laminar flow back through the valve where it passes nothing: q = C p, and 0 under the pump.

    Signature: in a hold pressure, load and stroke fall exponentially together, as by a leaking
    piston; under the pump nothing is lost.
    Siblings: piston leakage (the same in every hold, and a rise that slows with the pressure; with
    short records under the pump hardly to be told from it), load-cell drift (load alone moves).
    """

    conductance: Array = parameter(
        "C_valve",
        r"C_\mathrm{valve}",
        "m^3/(s Pa)",
        any_size(1e-14),
        meaning="leakage of the shut valve per pressure",
        absent=0.0,
    )

    name: ClassVar[str] = "shut-valve-leakage"
    equation: ClassVar[str] = "oil-balance"
    phrase: ClassVar[str] = "the shut valve lets oil back, in proportion to the pressure"
    source: ClassVar[str] = (
        "Merritt 1967, Hydraulic Control Systems, ch. 5: leakage of a valve at its null, laminar"
    )

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return what flows back."""
        return Action(leakage=self.conductance * state.pressure * (1.0 - state.pumped))
