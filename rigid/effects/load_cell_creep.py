"""A load cell that goes on giving under a constant load."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.declare import either_sign, lognormal, parameter


class LoadCellCreep(AbstractEffect):
    """The load is read as F + c G, T dG/dt = F - G: a share c of the load comes with a time T.

    Signature: in a hold the load alone goes on moving towards F (1 + c), and after the load is gone
    a part of it stays and fades; pressure and stroke are at rest.
    Siblings: load-cell drift (by time, whatever the load), piston leakage (pressure and stroke go
    along), the load cell's gain where T is far below the time of loading.
    """

    share: Array = parameter(
        "creep",
        r"c_\mathrm{cr}",
        "1",
        either_sign(0.005),
        meaning="share of the load by which the load cell creeps",
        absent=0.0,
    )
    time: Array = parameter(
        "tau_creep",
        r"\tau_\mathrm{cr}",
        "s",
        lognormal(5.0, 4.0),
        meaning="time in which the load cell creeps",
    )

    name: ClassVar[str] = "load-cell-creep"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the load cell creeps: a share of the load is read late"
    source: ClassVar[str] = (
        "OIML R 60, Metrological regulation for load cells: creep is what a reading moves by under "
        "a constant load; here one term of a relaxation"
    )
    steady: ClassVar[bool] = True
    scales: ClassVar[tuple[float, ...]] = (1e4,)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return nothing: the rig moves as it did."""
        return Action()

    def rates(self, action: Action, seen: Seen) -> tuple[Array, ...]:  # noqa: ARG002
        """Return how the load of a while ago follows that of now."""
        return ((seen.load - seen.own[0]) / self.time,)

    def sense(self, seen: Seen) -> Distortion:
        """Return what has crept."""
        return Distortion(load=self.share * seen.own[0])
