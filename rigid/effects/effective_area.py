"""Another area under the pressure than the nominal one."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import either_sign, parameter


class EffectiveArea(AbstractEffect):
    """The pressure acts on S (1 + delta) and the piston sweeps as much: F_p = S (1 + delta) p.

    The force gains delta S p and the oil balance loses delta S v_SS, so that what the oil gives to
    the piston is what the piston takes. The oil under compression keeps the nominal S (L_0 + x):
    S L_0 is the amount of oil at zero stroke, which the piston's seal does not change; only the
    share delta x/(L_0 + x) of its compliance is then left out, below 1 % of it for delta = 3 %.

    Signature: load over pressure differs from S by the factor 1 + delta at every load, loading and
    unloading alike; the stroke of a free run is shorter by the same factor.
    Siblings: gains of load cell and pressure gauge (0.1 % each), kappa for the stroke of a free
    run, pressure-dependent friction (which turns over on unloading), a return spring (which does
    not grow with pressure).
    """

    excess: Array = parameter(
        "area_excess",
        r"\delta_S",
        "1",
        either_sign(0.02),
        meaning="excess of the effective area over the nominal one",
        absent=0.0,
    )

    name: ClassVar[str] = "effective-area"
    equation: ClassVar[str] = "oil-balance"
    phrase: ClassVar[str] = "the pressure acts on another area than the nominal one"
    source: ClassVar[str] = (
        "paper, eqs. (5) and (8), with another S; S = 44.2 cm2 is nominal, eq. (1)"
    )
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force on, and the volume swept by, the area beyond the nominal one."""
        more = self.excess * state.area
        return Action(between=more * state.pressure, leakage=more * state.slip)
