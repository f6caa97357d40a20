"""Dry friction as elastic bristles that yield, in four variants.

A bristle of bending z gives with the sliding speed v as

    z' = v (1 - a(u) u),   u = z sgn(v) / (z_c g(v)),   force F z / z_c

where a is 0 while u is below 0.7 and rises to 1 at u = 1: below, the bristle is elastic and comes
back; at u = 1 it slides. Source: Dupont, Hayward, Armstrong, Altpeter 2002, IEEE Trans. Automatic
Control 47(5), eqs. (8)-(14). The catalogue's bristle yields from the first bending on.
"""

from dataclasses import dataclass
from math import copysign, cos, exp, pi
from typing import no_type_check

from rigid.generator.core import Action, Motion
from rigid.generator.hidden.base import Hidden, cause, spread

ELASTIC = 0.7
STIFF = 1.5e-5  # m, bending at which a stiff bristle slides: no step of the stroke sensor sees it


@no_type_check  # see Plant.rates
def bending_rate(bent: float, slip: float, limit: float) -> float:
    """Rate [m/s] of a bristle's bending; `bent` and `limit`, where it slides, in metres."""
    u = copysign(bent, bent * slip) / limit
    if u <= ELASTIC:
        return slip
    share = 1.0 if u >= 1.0 else 0.5 - 0.5 * cos(pi * (u - ELASTIC) / (1.0 - ELASTIC))
    return slip * (1.0 - share * u)


class Bristle(Hidden):
    """A force that one bristle passes on; a variant says how far it bends and what it passes on."""

    bending: float

    states = 1

    @no_type_check
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Resist the sliding of plunger in cylinder."""
        slip = motion.v_pl - motion.v_hc
        rate = bending_rate(own[0], slip, self.bending * self.reach(slip))
        force = self.force(motion, own[0], rate)
        return Action(force, -force, rates=(rate,))

    @no_type_check
    def reach(self, slip: float) -> float:
        """By how much further than `bending` it bends before it slides."""
        return 1.0

    @no_type_check
    def force(self, motion: Motion, bent: float, rate: float) -> float:
        """Force [N] at a bending [m] and its rate."""
        return self.amplitude * bent / self.bending


@cause(
    "coulomb-friction", "plunger-momentum", 20.0,
    "F = -F_C z/z_c, z of an elastic bristle that slides at z_c",
)  # fmt: skip
@dataclass(frozen=True)
class Coulomb(Bristle):
    """A force [N] that does not depend on speed; bending [m] at which it slides."""

    bending: float = spread(STIFF)


@cause(
    "stribeck-friction", "plunger-momentum", 12.0,
    "F = -F_C z/z_c, sliding at z = z_c (1 + e/(1 + (v/v_S)^2))",
)  # fmt: skip
@dataclass(frozen=True)
class Stribeck(Bristle):
    """Coulomb friction [N] that is `excess` times larger at rest and falls over `speed` [m/s]."""

    excess: float = spread(0.7)
    speed: float = spread(2e-3, 1.5)
    bending: float = spread(STIFF)

    @no_type_check
    def reach(self, slip: float) -> float:
        """Bend further at low speed."""
        return 1.0 + self.excess / (1.0 + (slip / self.speed) ** 2)


@cause(
    "lugre-friction", "plunger-momentum", 18.0,
    "F = -F_C (z/z_c + s exp(-(v/v_S)^2) dz/dt), sliding at z = z_c (1 + e exp(-|v|/v_S))",
)  # fmt: skip
@dataclass(frozen=True)
class LuGre(Bristle):
    """Friction of long bristles: as Stribeck's, with a bending [m] that shows and a damping [s/m].

    The damping force is amplitude * damping * dz/dt and goes with speed, as the authors ask for.
    """

    excess: float = spread(0.7)
    speed: float = spread(2e-3, 1.5)
    bending: float = spread(2e-4, 1.5)
    damping: float = spread(20.0, 1.5)

    @no_type_check
    def reach(self, slip: float) -> float:
        """Bend further at low speed."""
        return 1.0 + self.excess * exp(-abs(slip) / self.speed)

    @no_type_check
    def force(self, motion: Motion, bent: float, rate: float) -> float:
        """Damp its bending too."""
        damping = self.damping * exp(-(((motion.v_pl - motion.v_hc) / self.speed) ** 2))
        return self.amplitude * (bent / self.bending + damping * rate)


@cause(
    "pressure-dependent-friction", "plunger-momentum", 1e-6,
    "F = -c p/(1 + p/p_1) z/z_c, z of an elastic bristle that slides at z_c",
)  # fmt: skip
@dataclass(frozen=True)
class PressureDependent(Bristle):
    """Seal friction c p [N], c in m^2, that grows a little slower than the pressure."""

    fading: float = spread(2e8)
    bending: float = spread(STIFF)

    @no_type_check
    def force(self, motion: Motion, bent: float, rate: float) -> float:
        """Press with the oil; a seal without pressure does not rub."""
        p = max(motion.p, 0.0)
        return self.amplitude * p / (1.0 + p / self.fading) * bent / self.bending
