"""A strap that takes its time to let go."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, State, Strap
from rigid.effects.declare import any_size, lognormal, parameter


class GradualRelease(AbstractEffect):
    """The force of a strap falls over a while, by the law of `rigid.physics.strap`.

    The share of the preload that has gone by a time is u where the time is
    Q(u) ~ (u^a - 1)/a - ((1 - u)^b - 1)/b: a = b = 0 is logistic, a = b = 1 linear.

    Signature: the acceleration rises over some samples, not from one to the next, and swings less,
    the more so the faster a mode is. When a fifth of the preload has gone is a number of each
    release. Nothing in other records.
    Siblings: none that is near; a drag on the cylinder (0.17) and an accelerometer that swings on
    its mounting (0.15) come next.
    """

    duration: Array = parameter(
        "release_duration", r"d_0", "s", any_size(1e-3),
        meaning="time in which the force of a strap falls from 90 to 10 %", absent=0.0,
    )  # fmt: skip
    begin: Array = parameter(
        "release_begin", r"a_0", "1", lognormal(0.3, 4.0),
        meaning="how abruptly a strap begins to let go: 0 gradually, 1 with a corner, more at once",
    )  # fmt: skip
    end: Array = parameter(
        "release_end", r"b_0", "1", lognormal(0.3, 4.0),
        meaning="how abruptly a strap ends to let go",
    )  # fmt: skip

    name: ClassVar[str] = "gradual-release"
    equation: ClassVar[str] = "contact"
    phrase: ClassVar[str] = "the strap of a release takes its time to let go"
    source: ClassVar[str] = (
        "generalised lambda law: Freimer, Kollia, Mudholkar and Lin 1988, Communications in "
        "Statistics 17(10); that a strap may take a millisecond is a choice"
    )
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("release",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: once the strap has let go, all is as without it."""
        return Action()

    def strap(self) -> Strap:
        """Return its law."""
        return Strap(self.duration, self.begin, self.end)
