"""Forms that no entry of the catalogue has, beside those in flow, structure and sensing."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sin
from typing import ClassVar, no_type_check

import numpy as np

from rigid.generator.constants import AREA, BAR
from rigid.generator.core import Action, Motion, Piece, Rig, Run
from rigid.generator.hidden.base import Hidden


@dataclass(frozen=True)
class RoughBore(Hidden):
    """The bore is wavy: a force [N] on the plunger, periodic over `period` [m] of stroke."""

    period: float = 6e-3

    name: ClassVar[str] = "rough-bore"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -a sin(2 pi s/l) between plunger and cylinder"
    typical: ClassVar[float] = 9.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the period."""
        return cls(cls.typical, float(rng.uniform(3e-3, 9e-3)))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Push to and fro."""
        force = self.amplitude * sin(2.0 * pi * (motion.x_pl - motion.x_hc) / self.period)
        return Action(force, -force)


@dataclass(frozen=True)
class OilStiffening(Hidden):
    """The oil's bulk modulus grows with pressure, by this share at 300 bar."""

    column: float = 0.2
    modulus: float = 2e9

    name: ClassVar[str] = "oil-stiffening"
    equation: ClassVar[str] = "oil-balance"
    law: ClassVar[str] = "k_oil (1 + a p/300 bar) in place of k_oil"
    typical: ClassVar[float] = 1.5e-3

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the oil's column and modulus from the rig."""
        return (OilStiffening(self.amplitude, rig.L_0, rig.k_oil),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Give way less."""
        growth = self.amplitude * max(motion.p, 0.0) / (300.0 * BAR)
        nominal = AREA * (self.column + motion.x_pl - motion.x_hc) / self.modulus
        return Action(compliance=-nominal * growth / (1.0 + growth))
