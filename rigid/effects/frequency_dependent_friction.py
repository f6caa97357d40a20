"""Friction with memory: Maxwell branches in parallel."""

from functools import reduce
from operator import add
from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import STEADY_FRICTION, lognormal, parameter


class FrequencyDependentFriction(AbstractEffect):
    """Branches of a dashpot and a spring in series: tau dR/dt = mu v_SS - R, F_f = -sum R.

    Together they add sum mu_i / (1 + i omega tau_i). The priors keep the branches apart, so that
    they cannot change places: the first is slow (it carries the friction of steady running), the
    second fast.
    """

    branch_friction: Array = parameter(
        "mu_branch",
        r"\mu_i",
        "N s/m",
        lognormal(5e5, 5.0),
        lognormal(1e5, 5.0),
        meaning="friction coefficient of a branch with memory",
        absent=0.0,
        part_of=STEADY_FRICTION,
    )
    branch_time: Array = parameter(
        "tau_branch",
        r"\tau_i",
        "s",
        lognormal(0.2, 2.0),
        lognormal(8e-3, 2.0),
        meaning="memory of a branch of friction",
    )

    name: ClassVar[str] = "frequency-dependent-friction"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = (
        "friction with a memory: its coefficient depends on how fast the motion changes"
    )
    source: ClassVar[str] = "generalised Maxwell model; Ferry, Viscoelastic Properties, ch. 1"
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1e3, 1e3)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return the force of the branches and the rates at which they load."""
        rates = tuple(
            (self.branch_friction[i] * state.slip - force) / self.branch_time[i]
            for i, force in enumerate(own)
        )
        return Action(between=-reduce(add, own), rates=rates)

    def friction(self, omega: Array) -> Array:
        """Return the sum over branches of mu_i / (1 + i omega tau_i)."""
        branches = [
            self.branch_friction[i] / (1.0 + 1j * omega * self.branch_time[i])
            for i in range(len(self.scales))
        ]
        return reduce(add, branches)
