"""Equations of motion of one cylinder: a fixed core, and a sum of pieces that act on it.

Core: two masses, the load-cell spring, the oil. Everything else (friction, pump, frame, ice, and
any effect that is to be hidden in the data) is a `Piece`.

    (M_HC - M_Pl) x_HC''    = -k_LC x_HC - S p + forces on the cylinder
    (M_Pl + M_Fl/2) x_Pl''  =  S p + forces on the plunger
    p' (V/k_oil + compliances) = flows - S (x_Pl' - x_HC'),   V = S (L_0 + x_Pl - x_HC)

Source: eqs. (2)-(9), (21) of the paper, with the signs of (8) kept throughout.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
from scipy.integrate import solve_ivp

from rigid.generator.constants import AREA

CORE_STATES = 5


class Motion(NamedTuple):
    """State of the core: positions and speeds [m, m/s], positive toward the ice; pressure [Pa]."""

    x_hc: float
    v_hc: float
    x_pl: float
    v_pl: float
    p: float


class Action(NamedTuple):
    """What a piece does at one instant.

    - on_cylinder, on_plunger: forces [N], positive toward the ice
    - flow: oil into the chamber [m^3/s]
    - compliance: volume the chamber gains per pressure beside that of the oil [m^3/Pa]
    - rates: time derivatives of the states that the piece keeps for itself
    """

    on_cylinder: float = 0.0
    on_plunger: float = 0.0
    flow: float = 0.0
    compliance: float = 0.0
    rates: tuple[float, ...] = ()


class Piece:
    """One physical cause. A subclass overrides what it has; the defaults do nothing."""

    states: int = 0

    def breaks(self) -> tuple[float, ...]:
        """Times [s] at which the piece is not smooth; the solver restarts there."""
        return ()

    def during(self, start: float, end: float) -> Self:  # noqa: ARG002 - for subclasses
        """Give the piece as it is between two neighbouring breaks, smooth up to both ends."""
        return self

    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Forces and flow at time t; `own` holds the states that the piece keeps."""
        return Action()

    def read(self, times: np.ndarray, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:  # noqa: ARG002
        """Distort what perfect sensors would have read (channel -> SI values)."""
        return readings


@dataclass(frozen=True)
class Rig:
    """The core's numbers, SI. `k_frame` is that of the frame both cylinders are tested in."""

    k_LC: float
    k_oil: float
    L_0: float
    M_HC: float
    M_Pl: float
    M_Fl: float
    k_frame: float

    @property
    def mass_cylinder(self) -> float:
        """M_HC - M_Pl [kg], eq. (2)."""
        return self.M_HC - self.M_Pl

    @property
    def mass_plunger(self) -> float:
        """M_Pl + M_Fl / 2 [kg], eq. (3): the plunger carries half the plate."""
        return self.M_Pl + self.M_Fl / 2


@dataclass(frozen=True)
class Plant:
    """One cylinder: the core and its pieces."""

    rig: Rig
    pieces: tuple[Piece, ...]

    @property
    def states(self) -> int:
        """Length of the state vector: the core's, then each piece's own."""
        return CORE_STATES + sum(piece.states for piece in self.pieces)

    def during(self, start: float, end: float) -> "Plant":
        """Give the plant as it is between two neighbouring breaks."""
        return replace(self, pieces=tuple(piece.during(start, end) for piece in self.pieces))

    def rates(self, t: float, y: np.ndarray) -> list[float]:
        """Time derivative of the state vector."""
        rig, state = self.rig, y.tolist()
        motion = Motion(*state[:CORE_STATES])
        on_cylinder = -rig.k_LC * motion.x_hc - AREA * motion.p
        on_plunger = AREA * motion.p
        inflow = -AREA * (motion.v_pl - motion.v_hc)
        compliance = AREA * (rig.L_0 + motion.x_pl - motion.x_hc) / rig.k_oil
        own_rates: list[float] = []
        first = CORE_STATES
        for piece in self.pieces:
            last = first + piece.states
            action = piece.act(t, motion, state[first:last])
            on_cylinder += action.on_cylinder
            on_plunger += action.on_plunger
            inflow += action.flow
            compliance += action.compliance
            own_rates.extend(action.rates)
            first = last
        acceleration_hc = on_cylinder / rig.mass_cylinder
        acceleration_pl = on_plunger / rig.mass_plunger
        core = [motion.v_hc, acceleration_hc, motion.v_pl, acceleration_pl, inflow / compliance]
        return core + own_rates

    def at_rest(self, x_hc: float = 0.0, p: float = 0.0) -> np.ndarray:
        """State at rest with zero stroke, the pieces' own states at zero."""
        state = np.zeros(self.states)
        state[[0, 2, 4]] = x_hc, x_hc, p
        return state


def trajectory(plant: Plant, state: np.ndarray, times: np.ndarray) -> np.ndarray:
    """States at `times` (ascending, from 0 on), shape (states, times); it starts at t = 0.

    The solver restarts at every break of a piece, so it never steps over a switch of the valve.
    """
    end = float(times[-1])
    breaks = {t for piece in plant.pieces for t in piece.breaks() if 0.0 < t < end}
    parts = []
    for start, stop in pairwise(sorted({0.0, end} | breaks)):
        inside = times[(times >= start) & (times < stop)]
        solution = solve_ivp(
            plant.during(start, stop).rates,
            (start, stop),
            state,
            method="LSODA",
            t_eval=np.append(inside, stop),
            rtol=1e-9,
            atol=_absolute_tolerance(plant.states),
        )
        if not solution.success:
            raise RuntimeError(f"no solution from {start} s to {stop} s: {solution.message}")
        parts.append(solution.y[:, :-1])
        state = solution.y[:, -1]
    return np.column_stack([*parts, state])


def _absolute_tolerance(states: int) -> np.ndarray:
    """Far below a step of any converter: 1e-13 m, 1e-11 m/s, 1e-2 Pa; own states as lengths."""
    tolerance = np.full(states, 1e-13)
    tolerance[[1, 3]] = 1e-11
    tolerance[4] = 1e-2
    return tolerance


def readings(plant: Plant, states: np.ndarray, times: np.ndarray) -> dict[str, np.ndarray]:
    """What perfect sensors would have read of the states, in SI, by channel."""
    accelerations = [plant.rates(t, y)[3] for t, y in zip(times, states.T, strict=True)]
    values = {
        "load": -plant.rig.k_LC * states[0],
        "stroke": states[2] - states[0],
        "pressure": states[4],
        "acceleration": np.array(accelerations),
    }
    for piece in plant.pieces:
        values = piece.read(times, values)
    return values
