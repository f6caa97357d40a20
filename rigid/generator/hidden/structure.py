"""Causes in what holds the rig: load-cell end, root plate, frame, guides."""

from dataclasses import dataclass, replace
from math import cos, exp, pi
from typing import no_type_check

import numpy as np

from rigid.generator.core import Action, Motion, Piece, Rig, Run, Seen
from rigid.generator.hidden.base import Hidden, cause, of_rig, spread

FULL_LOAD = 200e3  # N


@cause(
    "load-cell-stiffening", "load-cell", 1e-3,
    "F_LC = -k_LC x (1 + a (x/x_1)^2), x_1 = 200 kN/k_LC",
)  # fmt: skip
@dataclass(frozen=True)
class Stiffening(Hidden):
    """The load-cell end as a cubic spring, stiffer by this share (as a secant) at 200 kN."""

    k_LC: float = of_rig("k_LC")

    channel = "load"

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Add the cubic part."""
        return Action(-self._more(motion.x_hc))

    def error(self, seen: Seen) -> np.ndarray:
        """Give what the whole spring carries beside."""
        return -self._more(seen.motion.x_hc)

    @no_type_check  # a number while it moves, an array once it is read
    def _more(self, x):
        return self.k_LC * x * self.amplitude * (x * self.k_LC / FULL_LOAD) ** 2


@cause(
    "free-root-plate", "root", 3.5e-4,
    "x_r'' = k_LC (x_HC - x_r)/M - w^2 x_r - 0.2 w x_r'", ("release",),
)  # fmt: skip
@dataclass(frozen=True)
class RootPlate(Hidden):
    """The root plate has a mass, this the inverse of it [1/kg], and hangs in a soft strap.

    - frequency [Hz]: of the plate alone in the strap; a tenth of critical damping goes with it
    """

    frequency: float = spread(3.0)
    k_LC: float = of_rig("k_LC")

    states = 2
    channel = "load"

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Give way; own states are place and speed of the plate."""
        place, speed = own
        omega = 2.0 * pi * self.frequency
        pull = self.k_LC * (motion.x_hc - place) * self.amplitude
        rates = (speed, pull - omega * omega * place - 0.2 * omega * speed)
        return Action(self.k_LC * place, rates=rates)

    def error(self, seen: Seen) -> np.ndarray:
        """Give the force that the spring is short of; it answers to the difference."""
        return self.k_LC * seen.own[0]


@cause(
    "seating-slack", "contact", 2.5e-6,
    "the frame takes k_frame (x - s (1 - exp(-x/s)))", ("frame",),
)  # fmt: skip
@dataclass(frozen=True)
class Slack(Hidden):
    """Play [m] before the frame takes the load, closing exponentially."""

    stiffness: float = of_rig("k_frame")

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Take off what the frame does not carry yet."""
        missing = self.amplitude * (1.0 - exp(-max(motion.x_pl, 0.0) / self.amplitude))
        return Action(on_plunger=self.stiffness * missing)


@dataclass(frozen=True)
class Holding(Piece):
    """A strap that lets go of a preload [N] in a time [s]."""

    preload: float
    lasts: float

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Hold what it still holds."""
        return Action(on_plunger=-self.preload * (1.0 + cos(pi * t / self.lasts)) / 2.0)


@cause(
    "gradual-release", "contact", 3e-4,
    "the strap holds F_0 (1 + cos(pi t/T))/2 until T after the release", ("release",),
)  # fmt: skip
@dataclass(frozen=True)
class GradualRelease(Hidden):
    """The strap takes this long [s] to let go; the preload is the run's."""

    preload: float = of_rig("preload")

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Give it with the run's preload."""
        return (replace(self, preload=run.hook()[0]),)

    def breaks(self) -> tuple[float, ...]:
        """When the strap has let go."""
        return (self.amplitude,)

    def during(self, start: float, end: float) -> Piece:
        """Give the strap until then, and nothing afterwards."""
        holds = (start + end) / 2 < self.amplitude
        return Holding(self.preload, self.amplitude) if holds else self


@cause("guide-drag", "cylinder-momentum", 6e3, "F = -c x_HC' on the cylinder")
@dataclass(frozen=True)
class GuideDrag(Hidden):
    """Guides drag on the cylinder as it gives way, in proportion to its speed [N s/m]."""

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Drag."""
        return Action(-self.amplitude * motion.v_hc)
