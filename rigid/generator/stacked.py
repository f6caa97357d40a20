"""One slow record with many sets of constants, integrated side by side.

Slopes by two dozen constants would take two dozen simulations of rigs that ring in step. Here the
numbers of the plants are arrays, one entry a rig, and the solver takes one step for all. What it
errs by is then nearly the same for all, and goes out of their differences.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import fields, is_dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, no_type_check

import numpy as np
from scipy.integrate import odeint

from rigid.generator.core import Run
from rigid.generator.draw import Truth
from rigid.generator.plant import TOLERANCE, Plant, Trajectory, absolute_tolerance, readings
from rigid.generator.simulate import plant_of, sampling_times


def side_by_side(truths: Sequence[Truth], runs: Sequence[Run]) -> list[dict[str, np.ndarray]]:
    """Perfect readings of one slow record by channel, for each pair of a truth and its run.

    The runs have the same programme of the valve; nothing is hidden in them.
    """
    plants = [plant_of(truth, run) for truth, run in zip(truths, runs, strict=True)]
    times = sampling_times(runs[0])
    none = np.zeros(times.size)
    return [
        readings(plant, Trajectory(states, none, none), times)
        for plant, states in zip(plants, _trajectories(plants, times), strict=True)
    ]


def _trajectories(plants: Sequence[Plant], times: np.ndarray) -> np.ndarray:
    """States from rest (plants, states, times)."""
    end = float(times[-1])
    breaks = {t for piece in plants[0].pieces for t in piece.breaks() if 0.0 < t < end}
    state = np.stack([plant.at_rest() for plant in plants])
    parts = []
    for start, stop in pairwise(sorted({0.0, end} | breaks)):
        inside = times[(times >= start) & ((times < stop) | (stop == end))]
        part = merged([plant.during(start, stop) for plant in plants])
        solution = _integrate(part, state, np.concatenate(([start], inside, [stop])))
        state = solution[-1]
        parts.append(solution[1:-1])
    return np.moveaxis(np.concatenate(parts), 0, -1)


def _integrate(part: Plant, state: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Solve a stretch without breaks, (times, plants, states); rigs do not know of each other."""
    count, size = state.shape

    @no_type_check  # see Plant.rates
    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.array(part.balance(t, list(y.reshape(count, size).T))).T.ravel()

    solution, notes = odeint(
        rates,
        state.ravel(),
        times,
        tfirst=True,
        ml=size - 1,
        mu=size - 1,
        rtol=TOLERANCE,
        atol=np.tile(absolute_tolerance(size), count),
        tcrit=times[-1:],
        mxstep=1_000_000,
        full_output=True,
    )
    if notes["message"] != "Integration successful.":
        raise RuntimeError(f"from {times[0]} s to {times[-1]} s: {notes['message']}")
    return solution.reshape(len(times), count, size)


def merged(values: Sequence[Any]) -> Any:
    """One value of the same build, with an array (n,) for every number that is not the same in all.

    Frozen values are filled by their dictionary, with what they would work out of their fields:
    they say of themselves that they hold floats.
    """
    first = values[0]
    if all(value is first or value == first for value in values):
        return first
    if is_dataclass(first):
        new = copy(first)
        names = [field.name for field in fields(first)]
        names += [n for n, v in vars(type(first)).items() if isinstance(v, cached_property)]
        new.__dict__.clear()
        new.__dict__.update({n: merged([getattr(v, n) for v in values]) for n in names})
        return new
    if isinstance(first, tuple):
        return tuple(merged(entries) for entries in zip(*values, strict=True))
    return np.array(values)
