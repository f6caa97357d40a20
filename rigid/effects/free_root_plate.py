"""A root plate that is not fixed."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Seen, State
from rigid.effects.declare import any_size, parameter


class FreeRootPlate(AbstractEffect):
    """The plate behind the load-cell end is free: M dv_root/dt = -F_LC, at rest until the release.

    The number that is sought is 1/M, for one cylinder: 0 is the fixed root of the paper. The strap
    goes round the whole rig, so that momentum is 0 before the release and after it. In a frame and
    on the ice the root is held.

    Signature: the acceleration of a release swings faster (10 ms where a fixed root has 13.6 ms)
    and falls on with the whole rig floating; nothing in the slow records.
    Siblings: a stiffer k_LC or oil (which the frame holds), friction with memory, whose storage
    part is a spring as well, friction that locks the plunger (10.3 ms).
    """

    inverse_mass: Array = parameter(
        "inverse_M_root",
        r"1/M_\mathrm{RP}",
        "1/kg",
        any_size(1.0 / 175.0),
        meaning="one over the mass of the root plate",
        absent=0.0,
    )

    name: ClassVar[str] = "free-root-plate"
    equation: ClassVar[str] = "root"
    phrase: ClassVar[str] = "the plate behind the load-cell end moves instead of standing still"
    source: ClassVar[str] = (
        "Newton's third law on F_LC, eq. (2), whose root plate RP the paper assumes fixed, though "
        "the rig hangs during a release; the usual 175 kg is a guess near the other plate"
    )
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1e-4, 1e-1)
    kinds: ClassVar[tuple[str, ...] | None] = ("release",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the plate acts through its place alone."""
        return Action()

    def root(self, own: tuple[Array, ...]) -> tuple[Array, Array] | None:
        """Return where the plate is and how fast it moves."""
        return own[0], own[1]

    def rates(self, action: Action, seen: Seen) -> tuple[Array, ...]:  # noqa: ARG002
        """Return speed and acceleration of the plate."""
        return seen.own[1], -self.inverse_mass * seen.load
