"""Forces between plunger and cylinder, or on them, that are not dry friction."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import ClassVar, no_type_check

import numpy as np

from rigid.generator.core import Action, Motion, Run
from rigid.generator.hidden.base import SLOW, Hidden, either, spread

GAS_LENGTH = 0.5  # m, of the gas that a back pressure squeezes
GAS_EXPONENT = 1.2
ROUNDED = 5e-5  # m/s, speed over which one direction passes into the other


@dataclass(frozen=True)
class Memory(Hidden):
    """A ladder of three Maxwell branches, each of this coefficient [N s/m], a factor 4 apart.

    - slowest: memory time [s] of the first
    """

    slowest: float = 0.12

    states = 3
    name: ClassVar[str] = "frequency-dependent-friction"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -sum_i mu/tau_i (s - z_i), z_i' = (s - z_i)/tau_i, tau_i = tau/4^i"
    typical: ClassVar[float] = 8e4

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the slowest time."""
        return cls(cls.typical, spread(rng, 0.12))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Resist the sliding of plunger in cylinder; own states are the dashpots' places."""
        stroke = motion.x_pl - motion.x_hc
        rates = tuple((stroke - z) / (self.slowest / 4**i) for i, z in enumerate(own))
        force = self.amplitude * sum(rates)
        return Action(force, -force, rates=rates)


@dataclass(frozen=True)
class ReturnSpring(Hidden):
    """A back pressure on the rod side [N] that is there from the first `toe` [m] of stroke on.

    It squeezes a gas as the plunger comes out, and so hardens a little.
    """

    toe: float = 2e-4

    name: ClassVar[str] = "return-spring"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -F_0 (s/(|s| + s_0) + (1 - s/L)^-1.2 - 1)"
    typical: ClassVar[float] = 40.0
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the toe."""
        return cls(cls.typical, spread(rng, 2e-4))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Push the plunger back in."""
        stroke = motion.x_pl - motion.x_hc
        gas = (1.0 - stroke / GAS_LENGTH) ** -GAS_EXPONENT - 1.0
        force = self.amplitude * (stroke / (abs(stroke) + self.toe) + gas)
        return Action(force, -force)


@dataclass(frozen=True)
class ConstantForce(Hidden):
    """A force [N] from outside on the plunger, there before the record began and ever since."""

    sign: int = 1

    name: ClassVar[str] = "constant-force"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = +-F_c on plunger and plate"
    typical: ClassVar[float] = 55.0
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the sign."""
        return cls(cls.typical, either(rng))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Push or pull the plunger."""
        return Action(on_plunger=self.sign * self.amplitude)


@dataclass(frozen=True)
class BackwardViscosity(Hidden):
    """A viscous coefficient [N s/m] beside the rest while the plunger goes back in."""

    sign: int = 1

    name: ClassVar[str] = "direction-dependent-viscosity"
    equation: ClassVar[str] = "plunger-momentum"
    law: ClassVar[str] = "F = -+mu_back (v + v_0 - sqrt(v^2 + v_0^2))/2"
    typical: ClassVar[float] = 2e4

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the sign."""
        return cls(cls.typical, either(rng))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Resist going back in (or ease it, within what the other friction resists)."""
        v = motion.v_pl - motion.v_hc
        back = (v + ROUNDED - sqrt(v * v + ROUNDED * ROUNDED)) / 2.0
        force = self.sign * self.amplitude * back
        return Action(force, -force)
