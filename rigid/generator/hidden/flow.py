"""Causes in pump and valve."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import erf, exp, pi, sin
from typing import ClassVar, no_type_check
from zlib import crc32

import numpy as np

from rigid.generator.constants import BAR, LITRE_PER_MINUTE, P_MAX
from rigid.generator.core import Action, Motion, Piece, Rig, Run
from rigid.generator.hidden.base import SLOW, Hidden, either, spread
from rigid.generator.pieces import Pump, pump_flow

FAST_LESS_SLOW = 2 * 4.965 * LITRE_PER_MINUTE  # eq. (22)
STAGE_WIDTH = 15.0 * BAR
HARMONIC = 0.3


def pumping(run: Run) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Ends of the stretches of a run's valve, and its flow fractions with the tank's left out."""
    fractions = tuple(run.kappa or 0.0 if s.position == "open" else 0.0 for s in run.valve)
    return tuple(s.until for s in run.valve), fractions


@dataclass(frozen=True)
class Valved(Pump):
    """What rides on the pump's flow; `shape` numbers are the cause's own."""

    shape: tuple[float, ...] = ()


class Slow(Valved):
    """The slow stage from a pressure on: shape (pressure [Pa], share of the paper's drop)."""

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Take the fast stage's surplus away."""
        pressure, share = self.shape
        above = 0.5 + 0.5 * erf((motion.p - pressure) / STAGE_WIDTH)
        return Action(flow=-self.fractions[0] * share * FAST_LESS_SLOW * above)


@dataclass(frozen=True)
class StageSwitch(Hidden):
    """The pump changes stage at p_max exp(-amplitude); share of the flow's drop in eq. (22).

    The drop has a known size, so that what makes the cause weak is a change of stage late in the
    rise. It acts while the pump works; the way to the tank knows nothing of the pump.
    """

    share: float = 1.0

    name: ClassVar[str] = "pump-stage-switch"
    equation: ClassVar[str] = "pump"
    law: ClassVar[str] = "q loses d 9.93 l/min (1 + erf((p - p_s)/15 bar))/2, p_s = p_max exp(-a)"
    typical: ClassVar[float] = 0.35
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the share."""
        return cls(cls.typical, 1.0 + 0.03 * float(rng.standard_normal()))

    def parameters(self) -> dict:
        """All its numbers, and the pressure of the switch [Pa]."""
        return super().parameters() | {"pressure": P_MAX * exp(-self.amplitude)}

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Ride on the run's pump."""
        return (Slow(*pumping(run), (P_MAX * exp(-self.amplitude), self.share)),)


class Beat(Valved):
    """A periodic part of the flow: shape (relative size, frequency [Hz], phase [rad])."""

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Add two harmonics of the fast stage's flow."""
        size, frequency, phase = self.shape
        angle = 2.0 * pi * frequency * t + phase
        beat = sin(angle) + HARMONIC * sin(2.0 * angle)
        return Action(flow=self.fractions[0] * size * pump_flow(0.0) * beat)


@dataclass(frozen=True)
class Ripple(Hidden):
    """A periodic part of the flow relative to it; its phase differs from record to record."""

    frequency: float = 8.0
    phases: int = 0

    name: ClassVar[str] = "pump-ripple"
    equation: ClassVar[str] = "pump"
    law: ClassVar[str] = "q gains a q_fast (sin(w t + phi) + 0.3 sin(2 (w t + phi)))"
    typical: ClassVar[float] = 6e-3
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw frequency and a seed for the phases."""
        return cls(cls.typical, float(rng.uniform(3.0, 16.0)), int(rng.integers(1 << 31)))

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Ride on the run's pump; one pump serves both cylinders of a record."""
        rng = np.random.default_rng([self.phases, crc32(run.name.encode())])
        phase = float(rng.uniform(0.0, 2.0 * pi))
        return (Beat(*pumping(run), (self.amplitude, self.frequency, phase)),)


@dataclass(frozen=True)
class ValveEvent(Hidden):
    """kappa changes at once by the factor exp(+-amplitude) for a stretch of one record."""

    sign: int = 1
    record: str = ""
    cylinder: str = ""
    start: float = 1.0
    end: float = 1.5

    name: ClassVar[str] = "valve-event"
    equation: ClassVar[str] = "pump"
    law: ClassVar[str] = "kappa exp(+-a) in place of kappa from t_1 to t_2 of one record"
    typical: ClassVar[float] = 5e-3
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:
        """Draw the record, and a stretch of it with the valve open."""
        slow = [run for run in runs if run.kind in {"frame", "free-run"}]
        run = slow[int(rng.integers(len(slow)))]
        opened = run.valve[0].until
        length = float(rng.uniform(0.15, 0.35) * min(opened, 4.0))
        start = float(rng.uniform(0.15 * opened, 0.9 * opened - length))
        return cls(cls.typical, either(rng), run.name, run.cylinder, start, start + length)

    def acts(self, run: Run) -> bool:
        """Whether it is the one record."""
        return super().acts(run) and (run.name, run.cylinder) == (self.record, self.cylinder)

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Add what the valve passes more or less meanwhile."""
        more = (run.kappa or 0.0) * (exp(self.sign * self.amplitude) - 1.0)
        return (Pump((self.start, self.end, run.duration), (0.0, more, 0.0)),)


class Slip(Valved):
    """Oil that slips back inside the pump: shape (share of the fast flow at 300 bar,)."""

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Lose flow, more than in proportion to the pressure."""
        share = self.shape[0] * (max(motion.p, 0.0) / (300.0 * BAR)) ** 1.5
        return Action(flow=-self.fractions[0] * pump_flow(0.0) * share)


@dataclass(frozen=True)
class PumpSlip(Hidden):
    """The pump delivers less against pressure: this share of the fast flow at 300 bar."""

    name: ClassVar[str] = "pump-slip"
    equation: ClassVar[str] = "pump"
    law: ClassVar[str] = "q loses a q_fast (p/300 bar)^1.5"
    typical: ClassVar[float] = 8e-4
    kinds: ClassVar[tuple[str, ...]] = SLOW

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Ride on the run's pump."""
        return (Slip(*pumping(run), (self.amplitude,)),)


@dataclass(frozen=True)
class Dribble(Valved):
    """Flow after the valve is shut, dying out from the time `since`: shape (share, time [s])."""

    since: float = 0.0

    def during(self, start: float, end: float) -> "Dribble":
        """Hold the fraction that was open before the stretch, if the valve is shut in it."""
        index = bisect_right(self.untils[:-1], (start + end) / 2)
        before = self.fractions[index - 1] if index and self.fractions[index] == 0.0 else 0.0
        since = self.untils[index - 1] if index else 0.0
        return replace(self, untils=(end,), fractions=(before,), since=since)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Let the flow die out."""
        share, lasting = self.shape
        left = share * exp(-(t - self.since) / lasting)
        return Action(flow=self.fractions[0] * pump_flow(motion.p) * left)


@dataclass(frozen=True)
class ValveDribble(Hidden):
    """The valve shuts badly: this share of the flow goes on and dies out over `lasting` [s]."""

    lasting: float = 0.5

    name: ClassVar[str] = "valve-dribble"
    equation: ClassVar[str] = "pump"
    law: ClassVar[str] = "after the valve shuts, kappa a exp(-(t - t_s)/T) q goes on"
    typical: ClassVar[float] = 7e-4
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw how long it lasts."""
        return cls(cls.typical, spread(rng, 0.5, 1.4))

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Ride on the run's pump."""
        return (Dribble(*pumping(run), (self.amplitude, self.lasting)),)
