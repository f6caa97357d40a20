"""Causes in the balance of the oil: area, leakage, air, a modulus that grows."""

from dataclasses import dataclass
from math import exp, log1p
from typing import no_type_check

from rigid.generator.constants import AREA, BAR
from rigid.generator.core import Action, Motion
from rigid.generator.hidden.base import Hidden, cause, either, of_rig, uniform

ATMOSPHERE = 1.01325 * BAR
NEAR_VACUUM = 0.1 * BAR  # over which the absolute pressure is kept from falling below none
GAP_OPENS = 1000.0 * BAR  # pressure at which a gap past the piston has doubled


@cause(
    "effective-area", "oil-balance", 8e-3,
    "S (1 +- d) in place of S: in the force, the swept volume and the oil's",
)  # fmt: skip
@dataclass(frozen=True)
class EffectiveArea(Hidden):
    """The pressure acts on an area larger or smaller by this share, and the oil fills that area."""

    sign: int = either()
    column: float = of_rig("L_0")
    modulus: float = of_rig("k_oil")

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Add the force and the volumes of the additional area."""
        x_hc, v_hc, x_pl, v_pl, p = motion
        area = self.sign * self.amplitude * AREA
        compliance = area * (self.column + x_pl - x_hc) / self.modulus
        return Action(-area * p, area * p, compliance=compliance, loss=area * (v_pl - v_hc))


@cause("piston-leakage", "oil-balance", 2e-17, "q = C p (1 + p/p_1)")
@dataclass(frozen=True)
class Leakage(Hidden):
    """Oil past the piston, [m^3/(s Pa)] at low pressure, through a gap that pressure widens."""

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Let oil out."""
        return Action(loss=self.amplitude * motion.p * (1.0 + motion.p / GAP_OPENS))


@cause(
    "entrained-air", "oil-balance", 1e-5,
    "V_air = a V (p_a/P)^(1/n), compliance V_air/(n P), P absolute",
)  # fmt: skip
@dataclass(frozen=True)
class Air(Hidden):
    """Air in the oil, this share of its volume at atmospheric pressure; a polytropic gas."""

    exponent: float = uniform(1.05, 1.35)  # between isothermal and adiabatic
    column: float = of_rig("L_0")

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Give way under pressure."""
        relative = (motion.p + ATMOSPHERE) / NEAR_VACUUM
        relative = relative if relative > 30.0 else log1p(exp(relative))
        absolute = NEAR_VACUUM * relative
        volume = AREA * (self.column + motion.x_pl - motion.x_hc)
        air = self.amplitude * volume * (ATMOSPHERE / absolute) ** (1.0 / self.exponent)
        return Action(compliance=air / (self.exponent * absolute))


@cause("oil-stiffening", "oil-balance", 1.5e-3, "k_oil (1 + a p/300 bar) in place of k_oil")
@dataclass(frozen=True)
class OilStiffening(Hidden):
    """The oil's bulk modulus grows with pressure, by this share at 300 bar."""

    column: float = of_rig("L_0")
    modulus: float = of_rig("k_oil")

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Give way less."""
        growth = self.amplitude * max(motion.p, 0.0) / (300.0 * BAR)
        nominal = AREA * (self.column + motion.x_pl - motion.x_hc) / self.modulus
        return Action(compliance=-nominal * growth / (1.0 + growth))
