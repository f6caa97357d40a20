"""One cylinder by mass of oil and momenta: P_hc, P_pl [kg m/s], x_hc, x_pl [m], m [kg].

Source: eqs. (2)-(8) of the paper; (9) integrated once is rho = rho_0 exp(p / k_oil), so that
p = k_oil (ln(1 + m / (rho_0 V_0)) - ln(1 + x / L_0)), with m the mass beyond that of the rest.
Signs: positive toward the ice.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, log1p, tanh
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

AREA, DENSITY, BAR = 44.2e-4, 900.0, 1e5
CORE = 5
TOLERANCE = 1e-8
"""Relative error of a step; with the absolute ones, far below a tenth of any sensor's noise."""
ABSOLUTE = (1e-7, 1e-7, 1e-11, 1e-11, 1e-10)
EVENTS_PER_STEP = 0.02
"""Longest step [s], so that none strides over a strap that lets go or a ramp of the valve."""


@dataclass(frozen=True)
class Rig:
    """Constants, SI: springs, oil, masses that move, and friction with two memories."""

    k_LC: float = 6e7
    k_oil: float = 2e9
    L_0: float = 0.2
    M_HC: float = 60.0
    M_Pl: float = 10.0
    M_Fl: float = 200.0
    k_frame: float = 2.0 * 200e9 * 15e-4 / 2.1
    mu: float = 8e4
    mu_branch: tuple[float, float] = (9e5, 1.2e5)
    tau_branch: tuple[float, float] = (0.2, 8e-3)
    pump_scale: float = 1.0
    intake: bool = False  # the pump's volume counts at atmospheric density

    @property
    def masses(self) -> tuple[float, float]:
        """Of cylinder and of plunger with half of the plate [kg]."""
        return self.M_HC - self.M_Pl, self.M_Pl + 0.5 * self.M_Fl


class Now(NamedTuple):
    """What a cause can see: positions, speeds, pressure, density, load, oil's volume flow, time."""

    t: float
    x_hc: float
    x_pl: float
    v_hc: float
    v_pl: float
    p: float
    rho: float
    load: float
    inflow: float = 0.0
    a_pl: float = 0.0

    @property
    def stroke(self) -> float:
        return self.x_pl - self.x_hc

    @property
    def speed(self) -> float:
        return self.v_pl - self.v_hc


class Push(NamedTuple):
    """What a cause does: a force on the plunger and against the cylinder, one on the plunger alone
    [N], a loss of oil [m^3/s at the chamber's density], the rates of its own states."""

    inner: float = 0.0
    outer: float = 0.0
    loss: float = 0.0
    rates: tuple[float, ...] = ()


class Cause:
    """A physical cause; the defaults do nothing. Those of the catalogue lie in causes.py."""

    states = 0
    nearest: str | None = None  # name in the catalogue of what it is a form of

    def acts_in(self, run: "Run", runs: "Sequence[Run]") -> bool:
        """Whether it acts in a run of a campaign."""
        return True

    def act(self, now: Now, own) -> Push:
        return Push()

    def load(self, compression: float, stiffness: float, own) -> float | None:
        """Force of the load-cell end, where it is not linear or its root moves."""
        return None

    def pump(self, litres: float, now: Now) -> float:
        return litres

    def air(self, p: float) -> float:
        """Volume of gas over the volume of oil at rest, less that at p = 0."""
        return 0.0

    def contact(self, x: float) -> float | None:
        """Deformation of the frame [m] at a place of the plunger."""
        return None

    def at_rest(self, load: float) -> tuple[float, ...]:
        return (0.0,) * self.states

    def set_back(self, load: float) -> float:
        """By how much the root has moved under a load [m]."""
        return 0.0

    def read(self, values: dict, now: Now, own) -> None:
        """Change what sensors would read, in place."""


@dataclass(frozen=True)
class Memory(Cause):
    """Force that forgets: stiffness times an elongation that relaxes, mu / tau and tau."""

    mu: float
    tau: float
    states = 1

    def act(self, now, own):
        return Push(-self.mu / self.tau * own[0], rates=(now.speed - own[0] / self.tau,))


@dataclass(frozen=True)
class Run:
    """One cylinder in one record: `valve` (until [s], fraction of the pump), the last to the end.

    - strap: (preload [N], instant [s], duration [s], law) of a release; the duration is that
      from 90 to 10 % of the load, under the linear law of all of it
    """

    name: str
    kind: str
    cylinder: str
    duration: float
    valve: tuple[tuple[float, float], ...]
    strap: tuple[float, float, float, str] | None = None

    def hold(self, t: float) -> float:
        """Share of the preload that the strap still carries."""
        if self.strap is None:
            return 0.0
        _, instant, lasts, law = self.strap
        late = t - instant
        if lasts == 0.0:
            return float(late < 0.0)
        if law == "logistic":
            late = min(max(late / lasts * 4.394, -300.0), 300.0)
            return 1.0 / (1.0 + exp(late))
        if law == "linear":
            return min(max(1.0 - late / lasts, 0.0), 1.0)
        return exp(-max(late, 0.0) / lasts * 2.197)

    def breaks(self) -> list[float]:
        """Instants at which the right-hand side is not smooth."""
        found = [until for until, _ in self.valve[:-1]]
        if self.strap is not None:
            _, instant, lasts, law = self.strap
            found += [instant] if law != "logistic" or lasts == 0.0 else []
            found += [instant + lasts] if law == "linear" else []
        return sorted({t for t in found if 0.0 < t < self.duration})


@dataclass(frozen=True)
class Plant:
    """A rig with its causes in one run."""

    rig: Rig
    run: Run
    causes: tuple[Cause, ...]

    def pressure(self, mass: float, stroke: float) -> float:
        """Pressure [Pa] of the oil that is there; with gas in it by Newton's method."""
        rig = self.rig
        full = log1p(mass / (DENSITY * AREA * rig.L_0))
        p = rig.k_oil * (full - log1p(stroke / rig.L_0))
        gassy = [cause for cause in self.causes if type(cause).air is not Cause.air]
        for _ in range(12 if gassy else 0):
            left, slope = self._room(p, full, stroke, gassy), 0.0
            slope = (self._room(p + 10.0, full, stroke, gassy) - left) / 10.0
            step = left / slope
            p = max(p - step, -0.9e5)
            if abs(step) < 1e-3:
                break
        return p

    def _room(self, p, full, stroke, gassy) -> float:
        oil = exp(full - p / self.rig.k_oil)
        return oil + sum(cause.air(p) for cause in gassy) - 1.0 - stroke / self.rig.L_0

    def mass_at(self, p: float) -> float:
        """Mass beyond that of the rest [kg] at zero stroke and a pressure."""
        gas = sum(cause.air(p) for cause in self.causes)
        return DENSITY * AREA * self.rig.L_0 * ((1.0 - gas) * exp(p / self.rig.k_oil) - 1.0)

    def own(self, y) -> list:
        parts, at = [], CORE
        for cause in self.causes:
            parts.append(y[at : at + cause.states])
            at += cause.states
        return parts

    def seen(self, t: float, y, valve: float | None = None) -> Now:
        """Everything at an instant, its rates left for `rates`."""
        return self._both(t, y, valve)[0]

    def rates(self, t: float, y, valve: float) -> list[float]:
        return self._both(t, y, valve)[1]

    def _both(self, t: float, y, valve: float | None) -> tuple[Now, list[float]]:
        rig, (m1, m2) = self.rig, self.rig.masses
        y = y.tolist()
        P_hc, P_pl, x_hc, x_pl, mass = y[:CORE]
        if valve is None:
            valve = next((f for until, f in self.run.valve if t < until), self.run.valve[-1][1])
        parts = self.own(y)
        p = self.pressure(mass, x_pl - x_hc)
        load, deformed = -rig.k_LC * x_hc, x_pl
        for cause, part in zip(self.causes, parts, strict=True):
            other = cause.load(-x_hc, rig.k_LC, part)
            load = load if other is None else other
            moved = cause.contact(x_pl)
            deformed = deformed if moved is None else moved
        rho = DENSITY * exp(p / rig.k_oil)
        now = Now(t, x_hc, x_pl, P_hc / m1, P_pl / m2, p, rho, load)
        litres = 6.645 - 4.965 * tanh(0.05 * (p / BAR - 700.0))
        for cause in self.causes:
            litres = cause.pump(litres, now)
        inflow = valve * rig.pump_scale * litres * 1e-3 / 60.0
        # What the pump takes in at atmospheric density is less when it is pressed together.
        inflow *= DENSITY / rho if rig.intake and valve > 0.0 else 1.0
        now = now._replace(inflow=inflow)
        inner, loss, own = AREA * p - rig.mu * now.speed, 0.0, []
        outer = -self.run.hold(t) * self.run.strap[0] if self.run.strap else 0.0
        outer -= rig.k_frame * deformed if self.run.kind == "frame" else 0.0
        later = []
        for cause, part in zip(self.causes, parts, strict=True):
            push = cause.act(now, part)
            inner, outer, loss = inner + push.inner, outer + push.outer, loss + push.loss
            later.append(push.rates)
        now = now._replace(a_pl=(inner + outer) / m2)
        for cause, part, rates in zip(self.causes, parts, later, strict=True):
            own += getattr(cause, "sensed", lambda *_, r=rates: r)(now, part)
        return now, [
            load - inner, inner + outer, now.v_hc, now.v_pl, rho * (inflow - loss), *own,
        ]  # fmt: skip

    def rest(self) -> np.ndarray:
        """State at rest: out of load, or under the strap."""
        load = self.run.strap[0] * self.run.hold(0.0) if self.run.strap else 0.0
        back = sum(cause.set_back(load) for cause in self.causes)
        x = -load / self.rig.k_LC - back
        own = [value for cause in self.causes for value in cause.at_rest(load)]
        return np.array([0.0, 0.0, x, x, self.mass_at(load / AREA), *own])


class Motion(NamedTuple):
    """Dense output: `pieces` of (start, end, fraction, solution)."""

    plant: Plant
    pieces: tuple

    def state(self, t: float) -> tuple[np.ndarray, float]:
        """State and valve's fraction at an instant; before the first it is the rest."""
        t = min(max(t, 0.0), self.pieces[-1][1])
        start, _, valve, dense = next(piece for piece in self.pieces if t <= piece[1])
        return dense(max(t, start)), valve

    def values(self, t: float) -> dict[str, float]:
        """What perfect sensors would read."""
        y, valve = self.state(t)
        now = self.plant.seen(t, y, valve)
        strap = self.plant.run.strap
        if strap is not None and strap[2] == 0.0 and t >= strap[1] > t - 1e-12:
            y = self.pieces[-1][3](t)  # on the instant itself: what comes after
        found = {
            "load": now.load, "stroke": now.stroke, "pressure": now.p, "acceleration": now.a_pl,
        }  # fmt: skip
        for cause, part in zip(self.plant.causes, self.plant.own(y), strict=True):
            cause.read(found, now, part)
        return found


def motion(rig: Rig, run: Run, causes: tuple[Cause, ...] = (), tolerance: float = TOLERANCE):
    """Integrate a run: Radau with dense output, anew at each switch and at the strap's end."""
    memories = tuple(map(Memory, rig.mu_branch, rig.tau_branch))
    plant = Plant(rig, run, memories + causes)
    y = plant.rest()
    absolute = np.array([*ABSOLUTE, *[1e-11] * (y.size - CORE)]) * tolerance / TOLERANCE
    absolute[CORE + 2 :] *= (
        [max(abs(v), 1.0) for v in getattr(causes[0], "scales", [1.0] * (y.size - CORE - 2))]
        if causes
        else []
    )
    pieces, edges = [], [0.0, *run.breaks(), run.duration]
    for start, end in pairwise(edges):
        middle = 0.5 * (start + end)
        valve = next((f for until, f in run.valve if middle < until), run.valve[-1][1])
        edge = 1e-12 if run.strap else 0.0  # the strap's law is seen from inside the stretch
        found = solve_ivp(
            lambda t, y, lo=start, hi=end, f=valve, e=edge: plant.rates(
                min(max(t, lo + e), hi - e), y, f
            ),
            (start, end), y, method="Radau", rtol=tolerance, atol=absolute,
            dense_output=True, max_step=EVENTS_PER_STEP,
            first_step=min(1e-6, 0.1 * (end - start)),
        )  # fmt: skip
        if not found.success:
            raise RuntimeError(f"{run.name}: {found.message}")
        y = found.y[:, -1]
        pieces.append((start, end, valve, found.sol))
    return Motion(plant, tuple(pieces))
