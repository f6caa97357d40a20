"""Causes in what holds the rig: load-cell end, root plate, frame, guides."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, pi
from typing import ClassVar, no_type_check

import numpy as np

from rigid.generator.core import Action, Motion, Piece, Rig, Run, Seen
from rigid.generator.hidden.base import Hidden, spread

FULL_LOAD = 200e3  # N


@dataclass(frozen=True)
class Stiffening(Hidden):
    """The load-cell end as a cubic spring, stiffer by this share (as a secant) at 200 kN."""

    k_LC: float = 6e7

    name: ClassVar[str] = "load-cell-stiffening"
    equation: ClassVar[str] = "load-cell"
    law: ClassVar[str] = "F_LC = -k_LC x (1 + a (x/x_1)^2), x_1 = 200 kN/k_LC"
    typical: ClassVar[float] = 1e-3

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the spring's stiffness from the rig."""
        return (Stiffening(self.amplitude, rig.k_LC),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Add the cubic part."""
        return Action(-self._more(motion.x_hc))

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Read the force in the whole spring."""
        return readings | {"load": readings["load"] - self._more(seen.motion.x_hc)}

    @no_type_check  # a number while it moves, an array once it is read
    def _more(self, x):
        return self.k_LC * x * self.amplitude * (x * self.k_LC / FULL_LOAD) ** 2


@dataclass(frozen=True)
class RootPlate(Hidden):
    """The root plate has a mass, this the inverse of it [1/kg], and hangs in a soft strap.

    - frequency [Hz]: of the plate alone in the strap; a tenth of critical damping goes with it
    """

    frequency: float = 3.0
    k_LC: float = 6e7

    states = 2
    name: ClassVar[str] = "free-root-plate"
    equation: ClassVar[str] = "root"
    law: ClassVar[str] = "x_r'' = k_LC (x_HC - x_r)/M - w^2 x_r - 0.2 w x_r'"
    typical: ClassVar[float] = 3.5e-4
    kinds: ClassVar[tuple[str, ...]] = ("release",)

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the frequency."""
        return cls(cls.typical, spread(rng, 3.0))

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the spring's stiffness from the rig."""
        return (RootPlate(self.amplitude, self.frequency, rig.k_LC),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Give way; own states are place and speed of the plate."""
        place, speed = own
        omega = 2.0 * pi * self.frequency
        pull = self.k_LC * (motion.x_hc - place) * self.amplitude
        rates = (speed, pull - omega * omega * place - 0.2 * omega * speed)
        return Action(self.k_LC * place, rates=rates)

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Read the force in the spring, which answers to the difference."""
        return readings | {"load": readings["load"] + self.k_LC * seen.own[0]}


@dataclass(frozen=True)
class Slack(Hidden):
    """Play [m] before the frame takes the load, closing exponentially."""

    stiffness: float = 2.857e8

    name: ClassVar[str] = "seating-slack"
    equation: ClassVar[str] = "contact"
    law: ClassVar[str] = "the frame takes k_frame (x - s (1 - exp(-x/s)))"
    typical: ClassVar[float] = 2.5e-6
    kinds: ClassVar[tuple[str, ...]] = ("frame",)

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the frame's stiffness from the rig."""
        return (Slack(self.amplitude, rig.k_frame),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Take off what the frame does not carry yet."""
        missing = self.amplitude * (1.0 - exp(-max(motion.x_pl, 0.0) / self.amplitude))
        return Action(on_plunger=self.stiffness * missing)


@dataclass(frozen=True)
class GuideDrag(Hidden):
    """Guides drag on the cylinder as it gives way, in proportion to its speed [N s/m]."""

    name: ClassVar[str] = "guide-drag"
    equation: ClassVar[str] = "cylinder-momentum"
    law: ClassVar[str] = "F = -c x_HC' on the cylinder"
    typical: ClassVar[float] = 6e3

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Drag."""
        return Action(-self.amplitude * motion.v_hc)
