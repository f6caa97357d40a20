"""One run: from its truth to the times and readings of perfect sensors."""

from typing import NamedTuple

import numpy as np

from rigid.generator.constants import AREA, FAST_RATE, SLOW_RATE
from rigid.generator.core import Piece, Run
from rigid.generator.draw import Truth
from rigid.generator.pieces import pieces_of
from rigid.generator.plant import TOLERANCE, Plant, Trajectory, readings, trajectory


class Readings(NamedTuple):
    """Sampling times [s] after the first row, and what is there to be read by channel, SI."""

    times: np.ndarray
    values: dict[str, np.ndarray]


def plant_of(truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()) -> Plant:
    """Assemble the cylinder as it is in this run."""
    return Plant(
        truth.rig, (truth.friction, *pieces_of(run, truth.rig), *acting(truth, run, hidden))
    )


def acting(truth: Truth, run: Run, hidden: tuple[Piece, ...]) -> tuple[Piece, ...]:
    """Pieces that stand for the hidden ones in this run."""
    return tuple(one for piece in hidden for one in piece.within(truth.rig, run))


def sampling_times(run: Run) -> np.ndarray:
    """Every sample of the run's recorder; those of the slow one run to the end."""
    if run.kind == "release":
        return np.arange(round(run.duration * FAST_RATE)) / FAST_RATE
    return np.arange(round(run.duration * SLOW_RATE) + 1) / SLOW_RATE


def simulate(
    truth: Truth, run: Run, hidden: tuple[Piece, ...] = (), tolerance: float = TOLERANCE
) -> Readings:
    """Integrate the run and read it with perfect sensors; `tolerance` is the solver's."""
    plant = plant_of(truth, run, hidden)
    times = sampling_times(run)
    known = not acting(truth, run, hidden)  # at rest in closed form
    if run.kind == "release":
        return Readings(times, _release(plant, run, known, tolerance))
    rest = plant.at_rest() if known else plant.balanced()
    return Readings(times, _slow(plant, rest, times, tolerance))


def _slow(
    plant: Plant, rest: np.ndarray, times: np.ndarray, tolerance: float
) -> dict[str, np.ndarray]:
    """Read every channel when its recorder does; before the record begins the rig is at rest."""
    delays: dict[str, float] = {}
    for piece in plant.pieces:
        for channel, delay in piece.delays().items():
            delays[channel] = delays.get(channel, 0.0) + delay
    taps = [tap for piece in plant.pieces for tap in piece.taps()]
    taps.append((0.0, 1.0 - sum(share for _, share in taps)))
    # Whole nanoseconds: the solver cannot step from a break to a sample 1e-16 s after it.
    looked = {
        (late, after): np.round(np.maximum(times + after - late, 0.0), 9)
        for late in {0.0, *delays.values()}
        for after, _ in taps
    }
    every = np.unique(np.concatenate([times, *looked.values()]))
    values = readings(plant, trajectory(plant, rest, every, tolerance), every)

    def read(channel: str) -> np.ndarray:
        late = delays.get(channel, 0.0)
        parts = [
            share * values[channel][np.searchsorted(every, looked[late, after])]
            for after, share in taps
        ]
        return np.sum(parts, axis=0)

    return {channel: read(channel) for channel in values}


def _release(plant: Plant, run: Run, known: bool, tolerance: float) -> dict[str, np.ndarray]:
    """At rest under the preload; then the load is gone at once. Pieces see time from the release.

    While the hook holds, forces balance and nothing moves; after it, no outer force is left.
    """
    times = sampling_times(run)
    preload, release_time = run.hook()
    rest = plant.at_rest(x_hc=-preload / plant.rig.k_LC, p=preload / AREA)
    if not known:
        rest = plant.balanced(preload)
    quiet = int(np.count_nonzero(times < release_time))
    motion = trajectory(plant, rest, np.append(0.0, times[quiet:] - release_time), tolerance)
    states = np.column_stack([np.repeat(rest[:, None], quiet, axis=1), motion.states[:, 1:]])
    acceleration = np.append(np.zeros(quiet), motion.acceleration[1:])
    flow = np.append(np.zeros(quiet), motion.flow[1:])
    return readings(plant, Trajectory(states, acceleration, flow), times)
