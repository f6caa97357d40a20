"""The full solve (diffrax on the rig's own equations) of any record, by one compiled program.

`rigid.physics.full.simulate` compiles a program for every record; here sample times are padded to
one length, so that all stretches of all records share it.
"""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.likelihood.groups import flow_label
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Track
from rigid.physics.full import integrate
from rigid.physics.rest import rest_under
from rigid.physics.rig import Rig, Surroundings, build_rig
from rigid.physics.sensors import Readings, readings

ROOM = 1280
"""Samples of a stretch, at most."""
EDGE = 1e-9

Stretch = tuple[Surroundings, np.ndarray, np.ndarray]
"""Surroundings, times to solve for, and which of them are samples."""


def stretches(track: Track, values: Mapping[str, Array]) -> list[Stretch]:
    """The record cut at its switches."""
    if track.drive is None:
        assert track.onset is not None  # a release has one
        delay = float(track.onset_time) - float(values[f"release_time[{track.label}]"])
        times = np.append(0.0, delay + track.interval * np.arange(int(track.samples) - track.onset))
        return [(Surroundings(jnp.zeros(()), 0.0, jnp.zeros(())), times, times > 0.0)]
    drive = track.drive
    contact = values["k_frame"] * (1.0 if track.kind == "frame" else 0.0)
    bounds = (drive.first, *drive.switches, np.inf)
    out = []
    for level, begin, end in zip(drive.levels, bounds[:-1], bounds[1:], strict=True):
        inside = drive.times[(drive.times >= begin - EDGE) & (drive.times < end - EDGE)]
        stop = min(end, drive.times[-1])
        later = inside[inside > begin + EDGE]
        times = np.array([begin, *later, *([stop] if not np.isin(stop, later) else [])])
        is_sample = np.isin(times, later)
        is_sample[0] = len(later) < len(inside)
        fraction = values[flow_label(track, level)] if level else 0.0 * contact
        out.append((Surroundings(contact, 0.0, fraction), times, is_sample))
    return out


@eqx.filter_jit
def solved(
    rig: Rig, outside: Surroundings, start: Array, times: Array, tolerance: float
) -> tuple[Array, Readings]:
    """State at the last of `times` (ROOM,) and ideal readings at all of them."""
    path = integrate(rig, outside, start, times, tolerance)
    return path[-1], jax.vmap(lambda y: readings(rig, y, outside))(path)


def padded(times: np.ndarray) -> Array:
    """Times followed by their last one."""
    return jnp.asarray(np.pad(times, (0, ROOM - len(times)), mode="edge"))


def begin(track: Track, rig: Rig, values: Mapping[str, Array]) -> Array:
    """State in which a record begins."""
    if track.drive is None:
        return rest_under(rig, values[f"preload[{track.label}]"])
    return jnp.zeros(len(rig.scales))


def simulated(problem: Problem, track: Track, values: dict, tolerance: float) -> Readings:
    """Ideal readings at the samples of a record, from its onset on if it is a release.

    - `values`: SI by label, scalars.
    """
    seen = Scoped(values, track.scope)
    rig = build_rig(problem.effects, seen)
    state, parts = begin(track, rig, values), []
    for outside, times, is_sample in stretches(track, seen):
        state, series = solved(rig, outside, state, padded(times), tolerance)
        parts.append([np.asarray(s)[: len(times)][is_sample] for s in series])
    return Readings(*(jnp.asarray(np.concatenate(p)) for p in zip(*parts, strict=True)))


def predictions(problem: Problem, values: dict, tolerance: float) -> list[dict[str, np.ndarray]]:
    """Ideal readings of every group, (samples, tracks, 1), as `Problem.predict` gives them."""
    out = []
    for group in problem.groups:
        series = {q: np.zeros((group.samples, len(group.tracks), 1)) for q in group.quantities}
        for i, track in enumerate(group.tracks):
            read, first = simulated(problem, track, values, tolerance), track.onset or 0
            for quantity, into in series.items():
                one = np.asarray(getattr(read, quantity))
                into[first : first + one.size, i, 0] = one
        out.append(series)
    return out
