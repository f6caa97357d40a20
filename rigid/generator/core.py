"""What a plant is made of, its state and the pieces that act on it, and what it is put through."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np


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
    - flow: oil through the hose into the chamber [m^3/s]
    - compliance: volume the chamber gains per pressure beside that of the oil [m^3/Pa]
    - rates: time derivatives of the states that the piece keeps for itself
    - loss: oil that leaves the chamber by another way than the hose [m^3/s]
    """

    on_cylinder: float = 0.0
    on_plunger: float = 0.0
    flow: float = 0.0
    compliance: float = 0.0
    rates: tuple[float, ...] = ()
    loss: float = 0.0


class Seen(NamedTuple):
    """What sensors can answer to, at the instants of the readings.

    - times: (n,) s; motion: the core's states, (n,) each
    - own: (states, n) of the piece that reads; flow: (n,) oil through the hose [m^3/s]
    """

    times: np.ndarray
    motion: Motion
    own: np.ndarray
    flow: np.ndarray


class Piece:
    """One physical cause. A subclass overrides what it has; the defaults do nothing."""

    states: int = 0

    def breaks(self) -> tuple[float, ...]:
        """Times [s] at which the piece is not smooth; the solver restarts there."""
        return ()

    def during(self, start: float, end: float) -> "Piece":
        """Give the piece as it is between two neighbouring breaks, smooth up to both ends."""
        return self

    def act(self, t: float, motion: Motion, own: list[float]) -> Action:
        """Forces and flow at time t; `own` holds the states that the piece keeps."""
        return Action()

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Distort what perfect sensors would have read (channel -> SI values)."""
        return readings

    def delays(self) -> Mapping[str, float]:
        """By how much [s] channels are read late (channel -> time, negative: early)."""
        return {}

    def taps(self) -> tuple[tuple[float, float], ...]:
        """At which times [s] beside its own a sample of a slow record is read, and their shares."""
        return ()

    def within(self, rig: "Rig", run: "Run") -> "tuple[Piece, ...]":
        """Give the pieces that stand for this one in a run; a cause may be absent from some."""
        return (self,)


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

    @cached_property
    def mass_cylinder(self) -> float:
        """M_HC - M_Pl [kg], eq. (2)."""
        return self.M_HC - self.M_Pl

    @cached_property
    def mass_plunger(self) -> float:
        """M_Pl + M_Fl / 2 [kg], eq. (3): the plunger carries half the plate."""
        return self.M_Pl + self.M_Fl / 2


@dataclass(frozen=True)
class Switch:
    """The valve is at `position` (open, shut, tank) until a time [s] after the first row."""

    until: float
    position: str


@dataclass(frozen=True)
class Run:
    """One cylinder in one record, as it was.

    - valve: the programme; the last entry's `until` is the end of the record
    - kappa, kappa_tank: flow fractions with the valve open (> 0) and to the tank (< 0)
    - preload: the true load before a release [N]; release_time [s] after the first row
    - file_start: what the file's own time reads at the first row [s], where it counts seconds
    - ice: knots of the ice load, times [s] and loads [N]
    """

    name: str
    kind: str
    cylinder: str
    duration: float
    valve: tuple[Switch, ...]
    kappa: float | None = None
    kappa_tank: float | None = None
    preload: float | None = None
    release_time: float | None = None
    file_start: float = 0.0
    ice: tuple[tuple[float, ...], tuple[float, ...]] | None = field(default=None, repr=False)

    def ice_load(self, times: np.ndarray) -> np.ndarray:
        """Compressive ice load [N] at times [s]; zero where there is no ice."""
        if self.ice is None:
            return np.zeros(times.size)
        knots, loads = self.ice
        return np.interp(times, knots, loads)

    def hook(self) -> tuple[float, float]:
        """Preload [N] and time [s] of a release; raises ValueError for another kind of run."""
        if self.preload is None or self.release_time is None:
            raise ValueError(f"{self.name} is a {self.kind} record, not a release")
        return self.preload, self.release_time
