"""Dry friction as elastic bristles that yield, in four variants.

A bristle of bending z gives with the sliding speed v as

    z' = v (1 - a(u) u),   u = z sgn(v) / (z_c g(v)),   force F z / z_c

where a is 0 while u is below 0.7 and rises to 1 at u = 1: below, the bristle is elastic and comes
back; at u = 1 it slides. Source: Dupont, Hayward, Armstrong, Altpeter 2002, IEEE Trans. Automatic
Control 47(5), eqs. (8)-(14). The catalogue's bristle yields from the first bending on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, cos, exp, pi
from typing import ClassVar, no_type_check

import numpy as np

from rigid.generator.core import Action, Motion, Run
from rigid.generator.hidden.base import Hidden, spread

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


@dataclass(frozen=True)
class Coulomb(Hidden):
    """A force [N] that does not depend on speed; bending [m] at which it slides."""

    bending: float = STIFF

    states = 1
    name: ClassVar[str] = "coulomb-friction"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -F_C z/z_c, z of an elastic bristle that slides at z_c"
    typical: ClassVar[float] = 20.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the bending."""
        return cls(cls.typical, spread(rng, STIFF))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Resist the sliding of plunger in cylinder."""
        slip = motion.v_pl - motion.v_hc
        force = self.amplitude * own[0] / self.bending
        return Action(force, -force, rates=(bending_rate(own[0], slip, self.bending),))


@dataclass(frozen=True)
class Stribeck(Hidden):
    """Coulomb friction [N] that is `excess` times larger at rest and falls over `speed` [m/s]."""

    excess: float = 0.5
    speed: float = 2e-3
    bending: float = STIFF

    states = 1
    name: ClassVar[str] = "stribeck-friction"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -F_C z/z_c, sliding at z = z_c (1 + e/(1 + (v/v_S)^2))"
    typical: ClassVar[float] = 12.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw excess and speed."""
        return cls(cls.typical, spread(rng, 0.7, 1.3), spread(rng, 2e-3, 1.5), spread(rng, STIFF))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Resist the sliding of plunger in cylinder."""
        slip = motion.v_pl - motion.v_hc
        limit = self.bending * (1.0 + self.excess / (1.0 + (slip / self.speed) ** 2))
        force = self.amplitude * own[0] / self.bending
        return Action(force, -force, rates=(bending_rate(own[0], slip, limit),))


@dataclass(frozen=True)
class LuGre(Hidden):
    """Friction of long bristles: as Stribeck's, with a bending [m] that shows and a damping [s/m].

    The damping force is amplitude * damping * dz/dt and goes with speed, as the authors ask for.
    """

    excess: float = 0.5
    speed: float = 2e-3
    bending: float = 2e-4
    damping: float = 20.0

    states = 1
    name: ClassVar[str] = "lugre-friction"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = (
        "F = -F_C (z/z_c + s exp(-(v/v_S)^2) dz/dt), sliding at z = z_c (1 + e exp(-|v|/v_S))"
    )
    typical: ClassVar[float] = 18.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the shape."""
        return cls(
            cls.typical,
            spread(rng, 0.7),
            spread(rng, 2e-3, 1.5),
            spread(rng, 2e-4, 1.5),
            spread(rng, 20.0, 1.5),
        )

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Resist the sliding of plunger in cylinder."""
        slip = motion.v_pl - motion.v_hc
        limit = self.bending * (1.0 + self.excess * exp(-abs(slip) / self.speed))
        rate = bending_rate(own[0], slip, limit)
        damping = self.damping * exp(-((slip / self.speed) ** 2))
        force = self.amplitude * (own[0] / self.bending + damping * rate)
        return Action(force, -force, rates=(rate,))


@dataclass(frozen=True)
class PressureDependent(Hidden):
    """Seal friction c p [N], c in m^2, that grows a little slower than the pressure."""

    fading: float = 2e8
    bending: float = STIFF

    states = 1
    name: ClassVar[str] = "pressure-dependent-friction"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -c p/(1 + p/p_1) z/z_c, z of an elastic bristle that slides at z_c"
    typical: ClassVar[float] = 1e-6

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw where it fades and the bending."""
        return cls(cls.typical, spread(rng, 2e8), spread(rng, STIFF))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Resist the sliding of plunger in cylinder; a seal without pressure does not rub."""
        slip = motion.v_pl - motion.v_hc
        p = max(motion.p, 0.0)
        force = self.amplitude * p / (1.0 + p / self.fading) * own[0] / self.bending
        return Action(force, -force, rates=(bending_rate(own[0], slip, self.bending),))
