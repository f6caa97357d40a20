"""Forces between plunger and cylinder, or on them, that are not dry friction."""

from dataclasses import dataclass
from math import pi, sin, sqrt
from typing import no_type_check

from rigid.generator.core import Action, Motion
from rigid.generator.hidden.base import SLOW, Hidden, cause, either, spread, uniform

GAS_LENGTH = 0.5  # m, of the gas that a back pressure squeezes
GAS_EXPONENT = 1.2
ROUNDED = 5e-5  # m/s, speed over which one direction passes into the other


@cause(
    "frequency-dependent-friction", "plunger-momentum", 8e4,
    "F = -sum_i mu/tau_i (s - z_i), z_i' = (s - z_i)/tau_i, tau_i = tau/4^i",
)  # fmt: skip
@dataclass(frozen=True)
class Memory(Hidden):
    """A ladder of three Maxwell branches, each of this coefficient [N s/m], a factor 4 apart.

    - slowest: memory time [s] of the first
    """

    slowest: float = spread(0.12)

    states = 3

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Resist the sliding of plunger in cylinder; own states are the dashpots' places."""
        stroke = motion.x_pl - motion.x_hc
        rates = tuple((stroke - z) / (self.slowest / 4**i) for i, z in enumerate(own))
        force = self.amplitude * sum(rates)
        return Action(force, -force, rates=rates)


@cause(
    "return-spring", "plunger-momentum", 40.0,
    "F = -F_0 (s/(|s| + s_0) + (1 - s/L)^-1.2 - 1)", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class ReturnSpring(Hidden):
    """A back pressure on the rod side [N] that is there from the first `toe` [m] of stroke on.

    It squeezes a gas as the plunger comes out, and so hardens a little.
    """

    toe: float = spread(2e-4)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Push the plunger back in."""
        stroke = motion.x_pl - motion.x_hc
        gas = (1.0 - stroke / GAS_LENGTH) ** -GAS_EXPONENT - 1.0
        force = self.amplitude * (stroke / (abs(stroke) + self.toe) + gas)
        return Action(force, -force)


@cause("constant-force", "plunger-momentum", 55.0, "F = +-F_c on plunger and plate", SLOW)
@dataclass(frozen=True)
class ConstantForce(Hidden):
    """A force [N] from outside on the plunger, there before the record began and ever since."""

    sign: int = either()

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Push or pull the plunger."""
        return Action(on_plunger=self.sign * self.amplitude)


@cause(
    "direction-dependent-viscosity", "plunger-momentum", 2e4,
    "F = -+mu_back (v + v_0 - sqrt(v^2 + v_0^2))/2",
)  # fmt: skip
@dataclass(frozen=True)
class BackwardViscosity(Hidden):
    """A viscous coefficient [N s/m] beside the rest while the plunger goes back in."""

    sign: int = either()

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Resist going back in (or ease it, within what the other friction resists)."""
        v = motion.v_pl - motion.v_hc
        back = (v + ROUNDED - sqrt(v * v + ROUNDED * ROUNDED)) / 2.0
        force = self.sign * self.amplitude * back
        return Action(force, -force)


@cause("rough-bore", "plunger-momentum", 9.0, "F = -a sin(2 pi s/l) between plunger and cylinder")
@dataclass(frozen=True)
class RoughBore(Hidden):
    """The bore is wavy: a force [N] on the plunger, periodic over `period` [m] of stroke."""

    period: float = uniform(3e-3, 9e-3)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Push to and fro."""
        force = self.amplitude * sin(2.0 * pi * (motion.x_pl - motion.x_hc) / self.period)
        return Action(force, -force)
