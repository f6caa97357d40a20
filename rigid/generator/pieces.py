"""Pieces of the base plant beside friction: pump and valve, frame, ice."""

from bisect import bisect_right
from dataclasses import dataclass, replace
from math import tanh
from typing import no_type_check

import numpy as np

from rigid.generator.constants import BAR, LITRE_PER_MINUTE, P_MAX
from rigid.generator.core import Action, Motion, Piece, Rig, Run


@no_type_check  # see Plant.rates
def pump_flow(p: float) -> float:
    """Flow of the pump [m^3/s] at pressure p [Pa], eq. (22) with pressures in bar."""
    bend = np.tanh if isinstance(p, np.ndarray) else tanh  # one number: ten times as fast
    litres = 6.645 - 4.965 * bend(0.05 * (p - P_MAX) / BAR)
    return litres * LITRE_PER_MINUTE


@dataclass(frozen=True)
class Pump(Piece):
    """Pump behind the valve: the fraction `fractions[i]` of its flow goes in until `untils[i]`.

    A positive fraction is pumping, zero a shut valve, a negative one the way to the tank. The
    last fraction holds to the end of the record, whatever its `until`.
    """

    untils: tuple[float, ...]
    fractions: tuple[float, ...]

    def breaks(self) -> tuple[float, ...]:
        """The valve's switches."""
        return self.untils[:-1]

    def during(self, start: float, end: float) -> "Pump":
        """Hold the fraction that the valve has midway."""
        index = bisect_right(self.untils[:-1], (start + end) / 2)
        return replace(self, untils=(end,), fractions=(self.fractions[index],))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Flow into the chamber."""
        return Action(flow=self.fractions[0] * pump_flow(motion.p))


@dataclass(frozen=True)
class Frame(Piece):
    """The steel frame around the rig, a spring [N/m] that the plunger pushes on, eq. (15)."""

    stiffness: float

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Push back on the plunger."""
        return Action(on_plunger=-self.stiffness * motion.x_pl)


@dataclass(frozen=True)
class Ice(Piece):
    """A compressive ice load [N] given beforehand, linear between its knots [s]."""

    times: tuple[float, ...]
    loads: tuple[float, ...]

    def breaks(self) -> tuple[float, ...]:
        """The knots."""
        return self.times

    def during(self, start: float, end: float) -> "Ice":
        """Keep the straight line through the two ends."""
        first, last = np.interp((start, end), self.times, self.loads).tolist()
        return Ice((start, end), (first, last))

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Push back on the plunger."""
        if len(self.times) > 2:  # not cut to a stretch: where the rig rests before a record begins
            return Action(on_plunger=-float(np.interp(t, self.times, self.loads)))
        (start, end), (first, last) = self.times, self.loads
        return Action(on_plunger=-(first + (last - first) * (t - start) / (end - start)))


def pieces_of(run: Run, rig: Rig) -> tuple[Piece, ...]:
    """Pump and outer load of a run."""
    fractions = {"open": run.kappa, "shut": 0.0, "tank": run.kappa_tank}
    untils = tuple(switch.until for switch in run.valve)
    pump = Pump(untils, tuple(fractions[switch.position] for switch in run.valve))
    outer = (Frame(rig.k_frame),) if run.kind == "frame" else ()
    ice = (Ice(*run.ice),) if run.ice else ()
    return (pump, *outer, *ice)
