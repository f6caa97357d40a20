"""A load cell that reads otherwise while the load grows than while it falls."""

from typing import ClassVar

from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State
from rigid.effects.bristle import share_rate
from rigid.effects.declare import either_sign, lognormal, parameter


class LoadCellHysteresis(AbstractEffect):
    """The load is read as F + h s, with ds/dt = (w - |w| s)/z, w the speed of the deflection.

    s runs from 0 at the start of a record to 1 while the end is pressed in and to -1 while it comes
    back, each time over a deflection of about z; F is k_LC times the deflection, so that z k_LC is
    a load. The law depends on the path alone and not on its speed: at a constant load s stays.

    Signature: at one and the same pressure the load is read 2 h higher after a rise than after a
    fall, in holds as on the way; pressure and stroke are as they were, and free runs, in which the
    load stays small, show nothing.
    Siblings: dry friction (the same loop of pressure against load in a frame, but it raises the
    pressure of a free run too), the load cell's gain where no load falls, load-cell stiffening (a
    curve without a loop), load-cell creep (the same after each change of the load, but it goes on
    in a hold), load-cell drift (goes on with time).
    """

    amplitude: Array = parameter(
        "hysteresis",
        r"h_\mathrm{LC}",
        "N",
        either_sign(300.0),
        meaning="half of the opening of the load cell's loop",
        absent=0.0,
    )
    width: Array = parameter(
        "hysteresis_width",
        r"z_\mathrm{LC}",
        "m",
        lognormal(1e-3, 3.0),
        meaning="deflection of the load-cell end over which the loop opens",
    )

    name: ClassVar[str] = "load-cell-hysteresis"
    equation: ClassVar[str] = "sensor"
    phrase: ClassVar[str] = "the load cell reads otherwise on the way up than on the way down"
    source: ClassVar[str] = (
        "OIML R 60, Metrological regulation for load cells: hysteresis is what readings of a load "
        "differ by between loading and unloading; data sheets state 0.02 to 0.1 % of the rated "
        "load, 2 h of 60 to 300 N in a cell of 300 kN (the plunger at 700 bar has 309 kN), "
        "and the prior is wider, as that of creep is; the law is that of Dahl 1968, "
        "TOR-0158(3107-18)-1, in the deflection"
    )
    scales: ClassVar[tuple[float, ...]] = (1.0,)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return the rate of the share of the loop; the rig moves as it did."""
        (share,) = own
        return Action(
            rates=(share_rate(share, state.v_root - state.v_cylinder, bending=self.width),)
        )

    def sense(self, seen: Seen) -> Distortion:
        """Return what the cell reads too much."""
        return Distortion(load=self.amplitude * seen.own[0])
