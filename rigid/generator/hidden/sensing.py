"""Causes in what the sensors read: the rig moves as it did."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import no_type_check
from zlib import crc32

import numpy as np

from rigid.generator.constants import LITRE_PER_MINUTE, SLOW_RATE
from rigid.generator.core import Action, Motion, Piece, Rig, Run, Seen
from rigid.generator.hidden.base import (
    SLOW,
    Hidden,
    InOneRecord,
    cause,
    drawn_by,
    either,
    of_rig,
    spread,
    uniform,
)

TURBULENT = 10.0 * LITRE_PER_MINUTE  # flow at which turbulence takes as much as the hose
QUICKER = 6.0  # of a load cell's second relaxation
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
STOPS = np.array([0.25, 0.5, 1.0, 2.0])  # at which those of a loop yield, over its width
THIRD = 0.2  # of a line's third harmonic, which transformers make
PER_NEWTON = {"load": 1.0, "stroke": 3e-7, "pressure": 60.0, "acceleration": 2e-3}
IN_LENGTHS = 1e10  # Pa that count as a metre where a solver's tolerance is one of lengths


@cause(
    "hose-pressure-drop",
    "sensor",
    3.5e8,
    "the gauge reads p + R q (1 + (|q|/(10 l/min))^0.75)",
    SLOW,
)
@dataclass(frozen=True)
class HoseDrop(Hidden):
    """The gauge sits before the hose; [Pa s/m^3] at low flow, turbulent beside it."""

    channel = "pressure"

    def error(self, seen: Seen) -> np.ndarray:
        """What the hose takes."""
        return self.amplitude * seen.flow * (1.0 + (np.abs(seen.flow) / TURBULENT) ** 0.75)


@dataclass(frozen=True)
class Lag(Hidden):
    """A channel is read through two equal low passes whose times [s] add up to this."""

    states = 2

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Follow what is read, one filter after the other; own states are lengths."""
        time, read = self.amplitude / 2.0, self.followed(motion)
        return Action(rates=((read - own[0]) / time, (own[0] - own[1]) / time))

    @no_type_check
    def followed(self, motion: Motion) -> float:
        """Give what is read, as a length."""
        raise NotImplementedError


@cause(
    "stroke-sensor-lag", "sensor", 2.5e-3,
    "the stroke is read through 1/(1 + i w tau/2)^2", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class StrokeLag(Lag):
    """The stroke sensor follows late."""

    channel = "stroke"

    @no_type_check
    def followed(self, motion: Motion) -> float:
        """Give the stroke."""
        return motion.x_pl - motion.x_hc

    def error(self, seen: Seen) -> np.ndarray:
        """What the second filter is behind."""
        return seen.own[1] - (seen.motion.x_pl - seen.motion.x_hc)


@cause(
    "load-cell-drift", "sensor", 4.5,
    "the load is read with +-D T (1 - exp(-t/T)) beside it", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class LoadDrift(Hidden):
    """The load cell's zero moves, at first by this [N/s], as the cell warms up in `warming` [s]."""

    sign: int = either()
    warming: float = spread(30.0)

    channel = "load"

    def error(self, seen: Seen) -> np.ndarray:
        """Give the drift so far."""
        drift = -self.warming * np.expm1(-seen.times / self.warming)
        return self.sign * self.amplitude * drift


@cause("clock-offset", "sensor", 2.5e-4, "the pressure on record at t is that of t -+ d", SLOW)
@dataclass(frozen=True)
class ClockOffset(Hidden):
    """The pressure is stamped late (or early) by this [s]."""

    sign: int = either()

    def delays(self) -> Mapping[str, float]:
        """Delay the pressure."""
        return {"pressure": self.sign * self.amplitude}


@cause("gauge-jump", "sensor", 9e3, "the gauge reads p +- a from t_1 of one record on", SLOW)
@dataclass(frozen=True)
class GaugeJump(InOneRecord):
    """The pressure gauge's zero jumps by this [Pa] in mid record, in one record, and stays."""

    instant: float = 2.0

    channel = "pressure"

    @classmethod
    def times(cls, rng: np.random.Generator, run: Run) -> tuple[float, ...]:
        """Draw the instant."""
        return (float(rng.uniform(0.3, 0.7) * run.duration),)

    def error(self, seen: Seen) -> np.ndarray:
        """Give the jump."""
        return self.sign * self.amplitude * (seen.times >= self.instant)


@cause("stroke-wave", "sensor", 1e-5, "the stroke is read with a sin(2 pi s/l) beside it", SLOW)
@dataclass(frozen=True)
class StrokeWave(Hidden):
    """The stroke sensor's scale is uneven: an error of this [m], periodic over `period` [m]."""

    period: float = uniform(2e-3, 6e-3)

    channel = "stroke"

    def error(self, seen: Seen) -> np.ndarray:
        """Give a sine of the stroke."""
        stroke = seen.motion.x_pl - seen.motion.x_hc
        return self.amplitude * np.sin(2 * np.pi * stroke / self.period)


@cause(
    "load-cell-creep", "sensor", 4.5e-4,
    "the cell reads F + a (0.7 G + 0.3 H), T G' = F - G, (T/6) H' = F - H", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class LoadCreep(Hidden):
    """The load cell creeps: a share of the load comes late, most of it after `lasting` [s]."""

    lasting: float = spread(3.0)
    k_LC: float = of_rig("k_LC")

    states = 2
    channel = "load"

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Follow the cylinder's place, which is the load over the stiffness."""
        slow, quick = own
        x_hc, time = motion.x_hc, self.lasting
        return Action(rates=((x_hc - slow) / time, QUICKER * (x_hc - quick) / time))

    def error(self, seen: Seen) -> np.ndarray:
        """Give what has crept."""
        return -(self.amplitude * self.k_LC * (0.7 * seen.own[0] + 0.3 * seen.own[1]))


@cause(
    "load-cell-hysteresis", "sensor", 33.0,
    "the cell reads F +- a mean of E_r/r, E_r' = F' held within +-r, r = w/4, w/2, w, 2 w", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class LoadHysteresis(Hidden):
    """The load cell has a loop, open by twice this [N]: stops in parallel (Prandtl, Ishlinskii).

    - width [N]: load over which the loop opens
    """

    sign: int = either()
    width: float = spread(3e4, 1.5)

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add what the stops hold; between two readings the load counts as monotonic."""
        load, limits = readings["load"], self.width * STOPS
        held = np.zeros((load.size, limits.size))
        held[0] = np.clip(load[0], -limits, limits)
        for i, change in enumerate(np.diff(load), start=1):
            held[i] = np.clip(held[i - 1] + change, -limits, limits)
        error = self.sign * self.amplitude * np.mean(held / limits, axis=1)
        return readings | {"load": load + error}


@cause(
    "pressure-gauge-lag", "sensor", 2.8e-4,
    "the gauge reads the pressure through 1/(1 + i w tau/2)^2", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class GaugeLag(Lag):
    """The pressure gauge follows late."""

    channel = "pressure"

    @no_type_check
    def followed(self, motion: Motion) -> float:
        """Give the pressure in 10 GPa."""
        return motion.p / IN_LENGTHS

    def error(self, seen: Seen) -> np.ndarray:
        """What the second filter is behind."""
        return IN_LENGTHS * seen.own[1] - seen.motion.p


@cause(
    "temperature-drift", "sensor", 40.0,
    "load and pressure are read with +-A t/(t + T) and r times that beside them", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class Warming(Hidden):
    """Load cell and gauge warm up; the load's zero ends this [N] off, half of it after `lasting`.

    - ratio [Pa/N]: of the gauge's drift to the load cell's
    """

    sign: int = either()
    ratio: float = spread(200.0)
    lasting: float = spread(5.0)

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Move both zeros."""
        moved = self.sign * self.amplitude * seen.times / (seen.times + self.lasting)
        return readings | {
            "load": readings["load"] + moved,
            "pressure": readings["pressure"] + self.ratio * moved,
        }


@cause(
    "accelerometer-resonance", "sensor", 0.05,
    "a share s of a is read through 0.8/(1 + 2 i z w/w_m - (w/w_m)^2) and 0.2 of that at 2 w_m",
    ("release",),
)  # fmt: skip
@dataclass(frozen=True)
class Mounting(Hidden):
    """A share of the acceleration is read through a mounting that swings, in two modes.

    - frequency [Hz]: of the lower one; damping: ratio to the critical one, of both
    """

    frequency: float = spread(400.0, 1.5)
    damping: float = spread(0.06)

    states = 4

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Follow the plate's speed, twice; own states are a speed and its rate for each mode."""
        rates = []
        for turn, (speed, rate) in zip(self._turns, (own[:2], own[2:]), strict=True):
            rates += [rate, turn * (turn * (motion.v_pl - speed) - 2.0 * self.damping * rate)]
        return Action(rates=tuple(rates))

    @property
    def _turns(self) -> tuple[float, float]:
        return 2.0 * np.pi * self.frequency, 4.0 * np.pi * self.frequency

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Read a share of both modes' rates of the speed in place of the plate's acceleration."""
        through = 0.8 * seen.own[1] + 0.2 * seen.own[3]
        direct = readings["acceleration"]
        return readings | {"acceleration": direct + self.amplitude * (through - direct)}


@dataclass(frozen=True)
class Line(Piece):
    """A line in all channels of one record: `amplitude` [N] in the load, `turn` [rad/s]."""

    amplitude: float
    turn: float
    seed: tuple[int, int]

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add two harmonics, whose angle is each channel's own."""
        out = {}
        for channel, read in readings.items():
            rng = np.random.default_rng([*self.seed, crc32(channel.encode())])
            angle = self.turn * seen.times + rng.uniform(0.0, 2.0 * np.pi)
            beat = np.sin(angle) + THIRD * np.sin(3.0 * angle)
            out[channel] = read + self.amplitude * PER_NEWTON[channel] * beat
        return out


@cause(
    "mains-pickup", "sensor", 10.0,
    "every sensor reads a (sin(w t + phi) + 0.2 sin(3 (w t + phi))) beside the truth",
)  # fmt: skip
@dataclass(frozen=True)
class Pickup(Hidden):
    """The mains in every sensor, in the load's by this [N]; angles differ by record and channel.

    - frequency [Hz]; angles: a seed for them
    """

    frequency: float = drawn_by(
        lambda rng: float(rng.choice((50.0, 60.0)) + rng.uniform(-0.05, 0.05)), 50.0
    )
    angles: int = drawn_by(lambda rng: int(rng.integers(1 << 31)), 0)

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Give the lines of a run."""
        seed = (self.angles, crc32(f"{run.name},{run.cylinder}".encode()))
        return (Line(self.amplitude, 2.0 * np.pi * self.frequency, seed),)


@cause(
    "sample-averaging", "sensor", 0.6,
    "a share s of every reading is its mean under a triangle of w intervals about the sample", SLOW,
)  # fmt: skip
@dataclass(frozen=True)
class Averaging(Hidden):
    """A share of every reading goes through a converter that averages twice.

    - window: share of the sampling interval on which the triangle stands
    """

    window: float = uniform(0.6, 1.0)

    def taps(self) -> tuple[tuple[float, float], ...]:
        """Give the nodes of Gauss on either side of the sample, where the valve may move."""
        away = 0.5 * (NODES + 1.0)
        shares = WEIGHTS * (1.0 - away) / np.sum(WEIGHTS * (1.0 - away))
        after = 0.5 * self.window / SLOW_RATE * away
        both = [*zip(-after, shares, strict=True), *zip(after, shares, strict=True)]
        return tuple((float(a), 0.5 * self.amplitude * float(s)) for a, s in both)
