"""Causes in pump and valve."""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import erf, exp, pi, sin, sqrt
from typing import no_type_check
from zlib import crc32

import numpy as np

from rigid.generator.constants import BAR, LITRE_PER_MINUTE, P_MAX
from rigid.generator.core import Action, Motion, Piece, Rig, Run
from rigid.generator.hidden.base import (
    SLOW,
    Hidden,
    InOneRecord,
    cause,
    drawn_by,
    spread,
    uniform,
)
from rigid.generator.pieces import Pump, pump_flow

FAST_LESS_SLOW = 2 * 4.965 * LITRE_PER_MINUTE  # eq. (22)
STAGE_WIDTH = 15.0 * BAR
HARMONIC = 0.3
TURBULENT = 100.0 * BAR  # above which a leak goes with the root of the pressure


@dataclass(frozen=True)
class Riding(Pump):
    """What rides on the pump's flow: `flow` [m^3/s] at (fraction, time [s], pressure [Pa])."""

    flow: Callable[[float, float, float], float]

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Flow into the chamber beside the pump's."""
        return Action(flow=self.flow(self.fractions[0], t, motion.p))


def riding(run: Run, flow: Callable[[float, float, float], float]) -> Riding:
    """Let a flow ride on a run's pump; the way to the tank knows nothing of the pump."""
    fractions = tuple(run.kappa or 0.0 if s.position == "open" else 0.0 for s in run.valve)
    return Riding(tuple(s.until for s in run.valve), fractions, flow)


@cause(
    "pump-stage-switch", "pump", 0.35,
    "q loses d 9.93 l/min (1 + erf((p - p_s)/15 bar))/2, p_s = p_max exp(-a)", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class StageSwitch(Hidden):
    """The pump changes stage at p_max exp(-amplitude); share of the flow's drop in eq. (22).

    The drop has a known size, so that what makes the cause weak is a change of stage late in the
    rise. It acts while the pump works.
    """

    share: float = drawn_by(lambda rng: 1.0 + 0.03 * float(rng.standard_normal()), 1.0)

    def parameters(self) -> dict:
        """All its numbers, and the pressure of the switch [Pa]."""
        return super().parameters() | {"pressure": P_MAX * exp(-self.amplitude)}

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Ride on the run's pump."""
        return (riding(run, partial(self.flow, P_MAX * exp(-self.amplitude))),)

    @no_type_check
    def flow(self, pressure: float, fraction: float, t: float, p: float) -> float:
        """Take the fast stage's surplus away above a pressure."""
        above = 0.5 + 0.5 * erf((p - pressure) / STAGE_WIDTH)
        return -fraction * self.share * FAST_LESS_SLOW * above


@cause(
    "pump-ripple", "pump", 6e-3, "q gains a q_fast (sin(w t + phi) + 0.3 sin(2 (w t + phi)))", SLOW
)
@dataclass(frozen=True)
class Ripple(Hidden):
    """A periodic part of the flow relative to it; its phase differs from record to record.

    - frequency [Hz]; phases: a seed for them
    """

    frequency: float = uniform(3.0, 16.0)
    phases: int = drawn_by(lambda rng: int(rng.integers(1 << 31)), 0)

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Ride on the run's pump; one pump serves both cylinders of a record."""
        rng = np.random.default_rng([self.phases, crc32(run.name.encode())])
        return (riding(run, partial(self.flow, float(rng.uniform(0.0, 2.0 * pi)))),)

    @no_type_check
    def flow(self, phase: float, fraction: float, t: float, p: float) -> float:
        """Add two harmonics of the fast stage's flow."""
        angle = 2.0 * pi * self.frequency * t + phase
        beat = sin(angle) + HARMONIC * sin(2.0 * angle)
        return fraction * self.amplitude * pump_flow(0.0) * beat


@cause(
    "valve-event", "pump", 5e-3,
    "kappa exp(+-a) in place of kappa from t_1 to t_2 of one record", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class ValveEvent(InOneRecord):
    """kappa changes at once by the factor exp(+-amplitude) for a stretch of one record."""

    start: float = 1.0
    end: float = 1.5

    @classmethod
    def times(cls, rng: np.random.Generator, run: Run) -> tuple[float, ...]:
        """Draw a stretch with the valve open."""
        opened = run.valve[0].until
        length = float(rng.uniform(0.15, 0.35) * min(opened, 4.0))
        start = float(rng.uniform(0.15 * opened, 0.9 * opened - length))
        return start, start + length

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Add what the valve passes more or less meanwhile."""
        more = (run.kappa or 0.0) * (exp(self.sign * self.amplitude) - 1.0)
        return (Pump((self.start, self.end, run.duration), (0.0, more, 0.0)),)


@cause("pump-slip", "pump", 8e-4, "q loses a q_fast (p/300 bar)^1.5", SLOW)
@dataclass(frozen=True)
class PumpSlip(Hidden):
    """The pump delivers less against pressure: this share of the fast flow at 300 bar."""

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Ride on the run's pump."""
        return (riding(run, self.flow),)

    @no_type_check
    def flow(self, fraction: float, t: float, p: float) -> float:
        """Lose flow, more than in proportion to the pressure."""
        share = self.amplitude * (max(p, 0.0) / (300.0 * BAR)) ** 1.5
        return -fraction * pump_flow(0.0) * share


@dataclass(frozen=True)
class Dribble(Riding):
    """Flow after the valve is shut, at the time gone since then."""

    since: float = 0.0

    def during(self, start: float, end: float) -> "Dribble":
        """Hold the fraction that was open before the stretch, if the valve is shut in it."""
        index = bisect_right(self.untils[:-1], (start + end) / 2)
        before = self.fractions[index - 1] if index and self.fractions[index] == 0.0 else 0.0
        since = self.untils[index - 1] if index else 0.0
        return replace(self, untils=(end,), fractions=(before,), since=since)

    @no_type_check
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Let the flow die out."""
        return super().act(t - self.since, motion, own)


@cause(
    "valve-dribble", "pump", 7e-4,
    "after the valve shuts, kappa a exp(-(t - t_s)/T) q goes on", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class ValveDribble(Hidden):
    """The valve shuts badly: this share of the flow goes on and dies out over `lasting` [s]."""

    lasting: float = spread(0.5, 1.4)

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Ride on the run's pump."""
        pump = riding(run, self.flow)
        return (Dribble(pump.untils, pump.fractions, pump.flow),)

    @no_type_check
    def flow(self, fraction: float, t: float, p: float) -> float:
        """What is left at a time after the valve was shut."""
        return fraction * pump_flow(p) * (self.amplitude * exp(-t / self.lasting))


@dataclass(frozen=True)
class Back(Pump):
    """Oil that flows back through a shut valve: `flow` [m^3/s] at a pressure [Pa]."""

    flow: Callable[[float], float]

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Let oil out where the valve passes nothing in."""
        return Action(loss=self.fractions[0] * self.flow(motion.p))


@cause(
    "shut-valve-leakage", "oil-balance", 7e-17,
    "q = C p/(1 + |p|/100 bar)^(1/2) where the valve passes nothing in",
)  # fmt: skip
@dataclass(frozen=True)
class ShutLeakage(Hidden):
    """A shut valve lets oil back, [m^3/(s Pa)] at low pressure, turbulent at high pressure."""

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Leak wherever the valve is not open."""
        shut = tuple(0.0 if s.position == "open" else 1.0 for s in run.valve)
        return (Back(tuple(s.until for s in run.valve), shut, self.flow),)

    @no_type_check
    def flow(self, p: float) -> float:
        """Give what flows back."""
        return self.amplitude * p / sqrt(1.0 + abs(p) / TURBULENT)
