"""The oil column under the piston as a spring."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import lognormal, parameter


class OilCompressibility(AbstractEffect):
    """Oil of bulk modulus k_oil: dp/dt = k_oil (inflow - S v_SS) / V."""

    bulk_modulus: Array = parameter(
        "k_oil", r"k_\mathrm{oil}", "Pa", lognormal(2e9, 1.05), meaning="bulk modulus of the oil"
    )

    name: ClassVar[str] = "oil-compressibility"
    equation: ClassVar[str] = "oil-balance"
    phrase: ClassVar[str] = "the oil compresses"
    source: ClassVar[str] = "paper, eqs. (4), (5), (9); (21) with k_oil in place of rho_oil"
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the compliance of the oil."""
        return Action(compliance=1.0 / self.bulk_modulus)
