"""One run: from its truth to the times and readings of perfect sensors."""

from typing import NamedTuple

import numpy as np

from rigid.generator.constants import AREA, FAST_RATE, SLOW_RATE
from rigid.generator.draw import Truth
from rigid.generator.plant import Piece, Plant, Trajectory, readings, trajectory
from rigid.generator.schedule import Run


class Readings(NamedTuple):
    """Sampling times [s] after the first row, and what is there to be read by channel, SI."""

    times: np.ndarray
    values: dict[str, np.ndarray]


def plant_of(truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()) -> Plant:
    """Assemble the cylinder as it is in this run."""
    return Plant(truth.rig, (truth.friction, *run.pieces(truth.rig), *hidden))


def sampling_times(run: Run) -> np.ndarray:
    """Every sample of the run's recorder; those of the slow one run to the end."""
    if run.kind == "release":
        return np.arange(round(run.duration * FAST_RATE)) / FAST_RATE
    return np.arange(round(run.duration * SLOW_RATE) + 1) / SLOW_RATE


def simulate(truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()) -> Readings:
    """Integrate the run and read it with perfect sensors."""
    plant = plant_of(truth, run, hidden)
    times = sampling_times(run)
    if run.kind == "release":
        return Readings(times, _release(plant, run, times))
    return Readings(times, readings(plant, trajectory(plant, plant.at_rest(), times), times))


def _release(plant: Plant, run: Run, times: np.ndarray) -> dict[str, np.ndarray]:
    """At rest under the preload; then the load is gone at once. Pieces see time from the release.

    While the hook holds, forces balance and nothing moves; after it, no outer force is left.
    """
    preload, release_time = run.hook()
    rest = plant.at_rest(x_hc=-preload / plant.rig.k_LC, p=preload / AREA)
    quiet = int(np.count_nonzero(times < release_time))
    motion = trajectory(plant, rest, np.append(0.0, times[quiet:] - release_time))
    states = np.column_stack([np.repeat(rest[:, None], quiet, axis=1), motion.states[:, 1:]])
    acceleration = np.append(np.zeros(quiet), motion.acceleration[1:])
    return readings(plant, Trajectory(states, acceleration), times)
