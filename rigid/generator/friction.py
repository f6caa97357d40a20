"""Linear friction with memory, as springs and dashpots that carry displacements.

    mu(omega) = mu_inf + sum_i mu_i / (1 + i omega tau_i)

Branch i is a spring k_i = mu_i / tau_i in series with a dashpot mu_i. Its state is the dashpot's
displacement z_i: the force is k_i (s - z_i) and z_i' = k_i (s - z_i) / mu_i, with s the stroke.
Source: eq. (18) against (17) of the paper asks for a coefficient that falls with frequency; the
Maxwell form is the generator's choice.
"""

from dataclasses import dataclass
from math import pi
from typing import no_type_check

from rigid.generator.core import Action, Motion, Piece


@dataclass(frozen=True)
class Friction(Piece):
    """Coefficients [N s/m] and memory times [s] of a dashpot and two Maxwell branches."""

    mu_inf: float
    mu_1: float
    tau_1: float
    mu_2: float
    tau_2: float

    states = 2

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Resist the sliding of plunger in cylinder, equal and opposite on the two."""
        stroke = motion.x_pl - motion.x_hc
        force_1 = self.mu_1 / self.tau_1 * (stroke - own[0])
        force_2 = self.mu_2 / self.tau_2 * (stroke - own[1])
        resistance = self.mu_inf * (motion.v_pl - motion.v_hc) + force_1 + force_2
        rates = (force_1 / self.mu_1, force_2 / self.mu_2)
        return Action(resistance, -resistance, rates=rates)

    def coefficient(self, frequency: float) -> complex:
        """mu(omega) [N s/m] at a frequency in Hz."""
        omega = 2j * pi * frequency
        branches = ((self.mu_1, self.tau_1), (self.mu_2, self.tau_2))
        return self.mu_inf + sum(mu / (1 + omega * tau) for mu, tau in branches)
