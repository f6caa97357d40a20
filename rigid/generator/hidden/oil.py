"""Causes in the balance of the oil: area, leakage, air."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log1p
from typing import ClassVar, no_type_check

import numpy as np

from rigid.generator.constants import AREA, BAR
from rigid.generator.core import Action, Motion, Piece, Rig, Run
from rigid.generator.hidden.base import Hidden, either

ATMOSPHERE = 1.01325 * BAR
NEAR_VACUUM = 0.1 * BAR  # over which the absolute pressure is kept from falling below none
GAP_OPENS = 1000.0 * BAR  # pressure at which a gap past the piston has doubled


@dataclass(frozen=True)
class EffectiveArea(Hidden):
    """The pressure acts on an area larger or smaller by this share, and the oil fills that area."""

    sign: int = 1
    column: float = 0.2
    modulus: float = 2e9

    name: ClassVar[str] = "effective-area"
    equation: ClassVar[str] = "oil-balance"
    law: ClassVar[str] = "S (1 +- d) in place of S: in the force, the swept volume and the oil's"
    typical: ClassVar[float] = 8e-3

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the sign."""
        return cls(cls.typical, either(rng))

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the oil's column and modulus from the rig."""
        return (EffectiveArea(self.amplitude, self.sign, rig.L_0, rig.k_oil),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Add the force and the volumes of the additional area."""
        x_hc, v_hc, x_pl, v_pl, p = motion
        area = self.sign * self.amplitude * AREA
        compliance = area * (self.column + x_pl - x_hc) / self.modulus
        return Action(-area * p, area * p, compliance=compliance, loss=area * (v_pl - v_hc))


@dataclass(frozen=True)
class Leakage(Hidden):
    """Oil past the piston, [m^3/(s Pa)] at low pressure, through a gap that pressure widens."""

    name: ClassVar[str] = "piston-leakage"
    equation: ClassVar[str] = "oil-balance"
    law: ClassVar[str] = "q = C p (1 + p/p_1)"
    typical: ClassVar[float] = 2e-17

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Let oil out."""
        return Action(loss=self.amplitude * motion.p * (1.0 + motion.p / GAP_OPENS))


@dataclass(frozen=True)
class Air(Hidden):
    """Air in the oil, this share of its volume at atmospheric pressure; a polytropic gas."""

    exponent: float = 1.2
    column: float = 0.2

    name: ClassVar[str] = "entrained-air"
    equation: ClassVar[str] = "oil-balance"
    law: ClassVar[str] = "V_air = a V (p_a/P)^(1/n), compliance V_air/(n P), P absolute"
    typical: ClassVar[float] = 1e-5

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the exponent between isothermal and adiabatic."""
        return cls(cls.typical, float(rng.uniform(1.05, 1.35)))

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the oil's column from the rig."""
        return (Air(self.amplitude, self.exponent, rig.L_0),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Give way under pressure."""
        relative = (motion.p + ATMOSPHERE) / NEAR_VACUUM
        relative = relative if relative > 30.0 else log1p(exp(relative))
        absolute = NEAR_VACUUM * relative
        volume = AREA * (self.column + motion.x_pl - motion.x_hc)
        air = self.amplitude * volume * (ATMOSPHERE / absolute) ** (1.0 / self.exponent)
        return Action(compliance=air / (self.exponent * absolute))
