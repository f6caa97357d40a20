"""What drives a record, known before any fit: sample times and the positions of the valve.

When the valve moves and how long a record lasts are arrays, and a grid goes on beyond its records
to one of a few lengths: records that differ in nothing else share their programs.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

State = TypeVar("State")
Led = Callable[[State], tuple[State, Array]]
"""A step of a march: the next state, and readings."""

FINE_WINDOW = 0.1
"""Seconds after a switch of the valve in which every sample is a step of its own, whatever the rig;
after them it is for as long as the rig rings on."""

FRESH = 8
"""Samples after a switch of the valve in which sensors may answer within a part of one."""

STRIDE = 8
"""Samples in one long step; a power of two, so that its matrices follow by doubling."""

EDGE = 1e-9
"""Relative slack [sampling intervals] when a switch is compared with a sample."""

LEAST_SIZE, COARSER = 64, 2
"""A grid has a multiple of so many samples, and of half of the power of two below it: few lengths,
so that a campaign seldom needs programs of its own; longer than its records by half at most."""


class Drive(eqx.Module):
    """One cylinder's part of a slow record.

    - `first` [s]: time of the first sample, at which the rig is at rest and out of load.
    - `interval` [s], `samples`: of the record. - `size`: samples of the grid that it lies on.
    - `switches` (stretches - 1,) [s]: when the valve moves; `levels`: for each stretch, which of
      the record's flow fractions applies (0 is shut).
    """

    first: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    interval: float = eqx.field(static=True)
    samples: Int[Array, ""] = eqx.field(converter=jnp.asarray)
    switches: Float[Array, " switches"] = eqx.field(converter=lambda s: jnp.asarray(s, float))
    levels: tuple[int, ...] = eqx.field(static=True)
    size: int = eqx.field(static=True)

    @property
    def times(self) -> np.ndarray:
        """Sample times [s] (samples,), where the record is known."""
        return float(self.first) + self.interval * np.arange(int(self.samples))


@dataclasses.dataclass(frozen=True)
class Plan:
    """How a group of drives is marched through together, a step a sample.

    - `near` (steps,): whether some drive's valve moves within the step or has just moved. - `fresh`
      (steps,): whether it did within the last few samples.
    - `levels`, `after` (steps, tracks): flow fraction that applies when the step begins and ends.
    - `kink` (steps, tracks): 0, or 1 + the number of the switch that falls inside the step.
    - `kink_rest` (kinks,) [s]: time from each switch to the end of its step, of one that falls into
      no step that of a whole step; `kink_place`: drive and number of the switch.
    - `samples`: of the grid; `interval` [s]. - `end` [s]: of the longest record.
    """

    near: Bool[Array, " steps"]
    fresh: Bool[Array, " steps"]
    levels: Int[Array, "steps tracks"]
    after: Int[Array, "steps tracks"]
    kink: Int[Array, "steps tracks"]
    kink_rest: Float[Array, " kinks"]
    kink_place: Int[np.ndarray, "kinks 2"]
    samples: int
    interval: float
    end: Float[Array, ""]

    def led(self, begin: Float[Array, ""], step: Led, state: State) -> tuple[State, Array]:
        """Take a step of a march where some record goes on; behind all of them, none.

        - `begin` [s]: of the step. - `step`: takes a state, returns the next and readings.

        Behind the records the state stays and readings are 0.
        """
        like = jax.eval_shape(step, state)[1]

        def still(state: State) -> tuple[State, Array]:
            return state, jnp.zeros(like.shape, like.dtype)

        return jax.lax.cond(begin > self.end + 0.5 * self.interval, still, step, state)

    def within(self, parts: int) -> tuple[Int[Array, " kinks"], Float[Array, " kinks"]]:
        """Return which part of its step each switch falls in, and the time [s] to that part's end.

        - `parts`: into which a step is cut.
        """
        length = self.interval / parts
        since = self.interval - self.kink_rest
        part = jnp.clip(jnp.floor(since / length + EDGE).astype(int), 0, parts - 1)
        return part, (part + 1) * length - since


def roomy(samples: int) -> int:
    """Samples of the grid that a record of so many samples lies on."""
    unit = max(LEAST_SIZE, 2 ** (samples.bit_length() - 1) // COARSER)
    return -(-samples // unit) * unit


def require_apart(drive: Drive) -> None:
    """Raise ValueError where two switches of a drive fall into one sampling interval."""
    at = (np.asarray(drive.switches) - float(drive.first)) / drive.interval
    inside = at[abs(at - np.round(at)) > EDGE]
    if len(np.unique(np.floor(inside))) < len(inside):
        raise ValueError("two valve positions within one sampling interval")


class Drives(eqx.Module):
    """Drives of a group side by side, arrays alone: groups of one shape share their programs.

    - `interval` [s]. - `samples` (tracks,): of each record. - `size`: samples of the common grid.
    - `switches` (tracks, most) [s]: when the valves move, since each first sample; never, where a
      drive has fewer. - `levels` (tracks, most + 1): flow fraction of each stretch; the last goes
      on where a drive has fewer.
    """

    interval: float = eqx.field(static=True)
    samples: Int[Array, " tracks"]
    size: int = eqx.field(static=True)
    switches: Float[Array, "tracks most"]
    levels: Int[Array, "tracks stretches"]

    @property
    def end(self) -> Float[Array, " tracks"]:
        """Time of each last sample [s], since the first."""
        return self.interval * (self.samples - 1)

    def finer(self, parts: int) -> "Drives":
        """Return the same drives on a grid with so many steps a sample."""
        return Drives(
            self.interval / parts,
            (self.samples - 1) * parts + 1,
            (self.size - 1) * parts + 1,
            self.switches,
            self.levels,
        )


def side_by_side(drives: Sequence[Drive], switches: int = 0) -> Drives:
    """Put drives of one sampling interval side by side.

    - `switches`: room for so many of each, or for as many as the drives have.
    """
    most = max(switches, *(len(d.levels) - 1 for d in drives))
    rows = [
        jnp.pad(d.switches - d.first, (0, most - len(d.levels) + 1), constant_values=jnp.inf)
        for d in drives
    ]
    levels = [d.levels + d.levels[-1:] * (most + 1 - len(d.levels)) for d in drives]
    return Drives(
        drives[0].interval,
        jnp.stack([d.samples for d in drives]),
        max(2, *(d.size for d in drives)),
        jnp.stack(rows),
        jnp.asarray(levels),
    )


def plan(drives: Drives) -> Plan:
    """Lay the common grid of several drives."""
    interval, steps = drives.interval, drives.size - 1
    at = drives.switches / interval
    levels, index = drives.levels, jnp.arange(steps)
    passed = jnp.sum(at < index[:, None, None] + EDGE, axis=2)
    track = jnp.arange(len(levels))
    begin = levels[track, passed]
    step, inside = _steps_of(at, steps)
    number = np.arange(1, at.size + 1).reshape(at.shape)
    # A switch inside no step goes to a row of its own, which is cut off.
    rows = jnp.where(inside, step, steps)
    kink = jnp.zeros((steps + 1, len(levels)), int).at[rows, track[:, None]].max(number)[:steps]
    switched = jnp.concatenate([jnp.zeros(1, int), levels[:, 1:].ravel()])[kink]
    place = np.stack(np.meshgrid(*map(np.arange, at.shape), indexing="ij"), axis=-1)
    return Plan(
        near=_near_a_switch(drives, at, index, int(np.ceil(FINE_WINDOW / interval)), 1),
        fresh=_near_a_switch(drives, at, index, FRESH, 0),
        levels=begin,
        after=jnp.where(kink > 0, switched, begin),
        kink=kink,
        kink_rest=jnp.where(inside, (step + 1 - at) * interval, interval).ravel(),
        kink_place=place.reshape(-1, 2),
        samples=drives.size,
        interval=interval,
        end=jnp.max(drives.end),
    )


def _steps_of(at: Float[Array, "tracks most"], steps: int) -> tuple[Array, Array]:
    """In which step each switch falls, and whether inside it, not on a sample or beyond the grid.

    - `at`: of the switches, in sampling intervals.
    """
    known = jnp.where(jnp.isfinite(at), at, -1.0)
    step = jnp.floor(known - EDGE).astype(int)
    inside = (step >= 0) & (step < steps) & (step + EDGE < known) & (step + 1 - known >= EDGE)
    return step, inside


def _near_a_switch(
    drives: Drives,
    at: Float[Array, "tracks most"],
    index: Int[Array, " steps"],
    window: int,
    before: int,
) -> Bool[Array, " steps"]:
    """Mark so many sample intervals after a switch of some drive, and some `before` it.

    All drives begin with one.
    """
    begins = jnp.concatenate([jnp.zeros((len(at), 1)), at], axis=1)
    first = jnp.floor(begins + EDGE)
    counted = first < drives.samples[:, None]
    now = index[:, None, None]
    return jnp.any((now >= first - before) & (now < first + window) & counted, axis=(1, 2))
