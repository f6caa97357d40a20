"""Equations of motion of one cylinder: a fixed core, and a sum of pieces that act on it.

Core: two masses, the load-cell spring, the oil. Everything else (friction, pump, frame, ice, and
any effect that is to be hidden in the data) is a `Piece`.

    (M_HC - M_Pl) x_HC''    = -k_LC x_HC - S p + forces on the cylinder
    (M_Pl + M_Fl/2) x_Pl''  =  S p + forces on the plunger
    p' (V/k_oil + compliances) = flows - losses - S (x_Pl' - x_HC'),   V = S (L_0 + x_Pl - x_HC)

Source: eqs. (2)-(9), (21) of the paper, with the signs of (8) kept throughout.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import NamedTuple, no_type_check

import numpy as np
from scipy.integrate import odeint

from rigid.generator.constants import AREA
from rigid.generator.core import Motion, Piece, Rig, Seen

CORE_STATES = 5
NEWTON_STEPS = 4  # to rest; a stiffening spring is solved to rounding in four
REST_STEPS = (1e-7, 1e2)  # m and Pa, over which slopes at rest are taken
TOLERANCE = 1e-9
"""Relative error that the solver allows itself a step, unless a campaign asks for another."""


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

    @cached_property
    def shares(self) -> tuple[tuple[Piece, slice], ...]:
        """Each piece with the part of the state vector that it keeps."""
        ends = list(accumulate((piece.states for piece in self.pieces), initial=CORE_STATES))
        return tuple(
            (piece, slice(*ends)) for piece, ends in zip(self.pieces, pairwise(ends), strict=True)
        )

    @no_type_check  # called 6e4 times a record: checked types (in tests) would cost a minute
    def rates(self, t: float, y: np.ndarray) -> list[float]:
        """Time derivative of the state vector."""
        return self.balance(t, y.tolist())

    @no_type_check
    def balance(self, t: float, state: list[float]) -> list[float]:
        """Time derivative of the states, listed; numbers, or arrays of many rigs."""
        rig = self.rig
        motion = Motion(*state[:CORE_STATES])
        x_hc, v_hc, x_pl, v_pl, p = motion
        on_cylinder = -rig.k_LC * x_hc - AREA * p
        on_plunger = AREA * p
        inflow = -AREA * (v_pl - v_hc)
        compliance = AREA * (rig.L_0 + x_pl - x_hc) / rig.k_oil
        rates = [v_hc, 0.0, v_pl, 0.0, 0.0]
        for piece, share in self.shares:
            to_cylinder, to_plunger, flow, extra, own_rates, loss = piece.act(
                t, motion, state[share]
            )
            on_cylinder += to_cylinder
            on_plunger += to_plunger
            inflow += flow - loss
            compliance += extra
            rates += own_rates
        rates[1] = on_cylinder / rig.mass_cylinder
        rates[3] = on_plunger / rig.mass_plunger
        rates[4] = inflow / compliance
        return rates

    def hose_flow(self, t: float, y: np.ndarray) -> float:
        """Oil through the hose into the chamber [m^3/s]."""
        state = y.tolist()
        motion = Motion(*state[:CORE_STATES])
        return sum(piece.act(t, motion, state[share]).flow for piece, share in self.shares)

    def at_rest(self, x_hc: float = 0.0, p: float = 0.0) -> np.ndarray:
        """State at rest with zero stroke, the pieces' own states at zero."""
        state = np.zeros(self.states)
        state[[0, 2, 4]] = x_hc, x_hc, p
        return state

    def balanced(self, preload: float = 0.0) -> np.ndarray:
        """State at rest in which all forces at t = 0 balance a compressive preload [N].

        Newton's method for position and pressure; the stroke is zero. Without pieces that push at
        rest it is x = -preload / k_LC and p = preload / S.
        """
        target = np.array([0.0, preload / self.rig.mass_plunger])
        placed = np.zeros(2)
        for _ in range(NEWTON_STEPS):
            excess = self._accelerations(placed) - target
            slopes = [
                (self._accelerations(placed + step) - target - excess) / step.sum()
                for step in np.diag(REST_STEPS)
            ]
            placed = placed - np.linalg.solve(np.stack(slopes, axis=1), excess)
        return self.at_rest(*placed)

    def _accelerations(self, placed: np.ndarray) -> np.ndarray:
        """Of cylinder and plunger [m/s^2] from rest at a position and pressure."""
        return np.array(self.rates(0.0, self.at_rest(*placed)))[[1, 3]]


class Trajectory(NamedTuple):
    """Motion at some times: states (states, times), plunger's acceleration [m/s^2], hose's flow."""

    states: np.ndarray
    acceleration: np.ndarray
    flow: np.ndarray


def trajectory(
    plant: Plant, state: np.ndarray, times: np.ndarray, tolerance: float = TOLERANCE
) -> Trajectory:
    """Integrate from `state` at t = 0 and give the motion at `times` (ascending, from 0 on).

    The solver restarts at every break of a piece, so it never steps over a switch of the valve.
    It is LSODA by way of `odeint`, which calls nothing but the rates from Python: in the frame
    the rig rings at 240 Hz for seconds after a switch, which takes 6e4 evaluations a record.
    """
    end = float(times[-1])
    breaks = {t for piece in plant.pieces for t in piece.breaks() if 0.0 < t < end}
    states, accelerations, flows = [], [], []
    for start, stop in pairwise(sorted({0.0, end} | breaks)):
        inside = times[(times >= start) & ((times < stop) | (stop == end))]
        part = plant.during(start, stop)
        solution = _integrate(part, state, np.concatenate(([start], inside, [stop])), tolerance)
        state = solution[-1]
        states.append(solution[1:-1])
        accelerations += [part.rates(t, y)[3] for t, y in zip(inside, states[-1], strict=True)]
        flows += [part.hose_flow(t, y) for t, y in zip(inside, states[-1], strict=True)]
    return Trajectory(np.concatenate(states).T, np.array(accelerations), np.array(flows))


def _integrate(part: Plant, state: np.ndarray, times: np.ndarray, tolerance: float) -> np.ndarray:
    """Solve a stretch without breaks; it ends at the last of `times`, shape (times, states)."""
    solution, notes = odeint(
        part.rates,
        state,
        times,
        tfirst=True,
        rtol=tolerance,
        atol=tolerance / TOLERANCE * absolute_tolerance(part.states),
        tcrit=times[-1:],
        mxstep=1_000_000,
        full_output=True,
    )
    if notes["message"] != "Integration successful.":
        raise RuntimeError(f"from {times[0]} s to {times[-1]} s: {notes['message']}")
    return solution


def absolute_tolerance(states: int) -> np.ndarray:
    """1e-12 m, 1e-9 m/s, 0.1 Pa, far below the sensors' noise; own states count as lengths."""
    tolerance = np.full(states, 1e-12)
    tolerance[[1, 3]] = 1e-9
    tolerance[4] = 0.1
    return tolerance


def readings(plant: Plant, motion: Trajectory, times: np.ndarray) -> dict[str, np.ndarray]:
    """What perfect sensors would have read of the motion, in SI, by channel."""
    values = {
        "load": -plant.rig.k_LC * motion.states[0],
        "stroke": motion.states[2] - motion.states[0],
        "pressure": motion.states[4],
        "acceleration": motion.acceleration,
    }
    core = Motion(*motion.states[:CORE_STATES])
    for piece, share in plant.shares:
        values = piece.read(Seen(times, core, motion.states[share], motion.flow), values)
    return values
