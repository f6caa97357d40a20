"""Causes in what the sensors read: the rig moves as it did."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from rigid.generator.constants import LITRE_PER_MINUTE
from rigid.generator.core import Action, Motion, Piece, Rig, Run, Seen
from rigid.generator.hidden.base import SLOW, Hidden, either, spread

TURBULENT = 10.0 * LITRE_PER_MINUTE  # flow at which the fittings take as much as the hose


@dataclass(frozen=True)
class HoseDrop(Hidden):
    """The gauge sits before the hose; [Pa s/m^3] at low flow, and fittings beside it."""

    name: ClassVar[str] = "hose-pressure-drop"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the gauge reads p + R q (1 + |q|/(10 l/min))"
    typical: ClassVar[float] = 3.5e8
    kinds: ClassVar[tuple[str, ...]] = SLOW

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add what hose and fittings take."""
        drop = self.amplitude * seen.flow * (1.0 + np.abs(seen.flow) / TURBULENT)
        return readings | {"pressure": readings["pressure"] + drop}


@dataclass(frozen=True)
class StrokeLag(Hidden):
    """The stroke is read through two equal low passes whose times [s] add up to this."""

    states = 2
    name: ClassVar[str] = "stroke-sensor-lag"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the stroke is read through 1/(1 + i w tau/2)^2"
    typical: ClassVar[float] = 2.5e-3
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Follow the stroke, one filter after the other."""
        time = self.amplitude / 2.0
        stroke = motion.x_pl - motion.x_hc
        return Action(rates=((stroke - own[0]) / time, (own[0] - own[1]) / time))

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Read what the second filter gives."""
        late = seen.own[1] - (seen.motion.x_pl - seen.motion.x_hc)
        return readings | {"stroke": readings["stroke"] + late}


@dataclass(frozen=True)
class LoadDrift(Hidden):
    """The load cell's zero moves, at first by this [N/s], as the cell warms up in `warming` [s]."""

    sign: int = 1
    warming: float = 30.0

    name: ClassVar[str] = "load-cell-drift"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the load is read with +-D T (1 - exp(-t/T)) beside it"
    typical: ClassVar[float] = 4.5
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw sign and time."""
        return cls(cls.typical, either(rng), spread(rng, 30.0))

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add the drift so far."""
        drift = -self.warming * np.expm1(-seen.times / self.warming)
        return readings | {"load": readings["load"] + self.sign * self.amplitude * drift}


@dataclass(frozen=True)
class ClockOffset(Hidden):
    """The pressure is stamped late (or early) by this [s]."""

    sign: int = 1

    name: ClassVar[str] = "clock-offset"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the pressure on record at t is that of t -+ d"
    typical: ClassVar[float] = 2.5e-4
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the sign."""
        return cls(cls.typical, either(rng))

    def delays(self) -> Mapping[str, float]:
        """Delay the pressure."""
        return {"pressure": self.sign * self.amplitude}


@dataclass(frozen=True)
class GaugeJump(Hidden):
    """The pressure gauge's zero jumps by this [Pa] in mid record, in one record, and stays."""

    sign: int = 1
    record: str = ""
    cylinder: str = ""
    instant: float = 2.0

    name: ClassVar[str] = "gauge-jump"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the gauge reads p +- a from t_1 of one record on"
    typical: ClassVar[float] = 9e3
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:
        """Draw sign, record and instant."""
        slow = [run for run in runs if run.kind in {"frame", "free-run"}]
        run = slow[int(rng.integers(len(slow)))]
        instant = float(rng.uniform(0.3, 0.7) * run.duration)
        return cls(cls.typical, either(rng), run.name, run.cylinder, instant)

    def acts(self, run: Run) -> bool:
        """Whether it is the one record."""
        return super().acts(run) and (run.name, run.cylinder) == (self.record, self.cylinder)

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add the jump."""
        jump = self.sign * self.amplitude * (seen.times >= self.instant)
        return readings | {"pressure": readings["pressure"] + jump}


@dataclass(frozen=True)
class StrokeWave(Hidden):
    """The stroke sensor's scale is uneven: an error of this [m], periodic over `period` [m]."""

    period: float = 3e-3

    name: ClassVar[str] = "stroke-wave"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the stroke is read with a sin(2 pi s/l) beside it"
    typical: ClassVar[float] = 1e-5
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the period."""
        return cls(cls.typical, float(rng.uniform(2e-3, 6e-3)))

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add the error."""
        stroke = seen.motion.x_pl - seen.motion.x_hc
        error = self.amplitude * np.sin(2 * np.pi * stroke / self.period)
        return readings | {"stroke": readings["stroke"] + error}


@dataclass(frozen=True)
class LoadCreep(Hidden):
    """The load cell creeps: it reads this share of the load more, once `lasting` [s] have gone."""

    lasting: float = 3.0
    k_LC: float = 6e7

    states = 1
    name: ClassVar[str] = "load-cell-creep"
    equation: ClassVar[str] = "sensor"
    law: ClassVar[str] = "the cell reads F + a G, T G' = F - G"
    typical: ClassVar[float] = 3.5e-4
    kinds: ClassVar[tuple[str, ...]] = SLOW

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:  # noqa: ARG003
        """Draw the time."""
        return cls(cls.typical, spread(rng, 3.0))

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Take the spring's stiffness from the rig."""
        return (LoadCreep(self.amplitude, self.lasting, rig.k_LC),)

    @no_type_check  # see Plant.rates
    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        """Follow the cylinder's place, which is the load over the stiffness."""
        return Action(rates=((motion.x_hc - own[0]) / self.lasting,))

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add what has crept."""
        return readings | {"load": readings["load"] - self.amplitude * self.k_LC * seen.own[0]}
