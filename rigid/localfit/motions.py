"""What the records of a measured motion tell beside the force: position, speed and pressure.

They are no readings of the model, which follows them; but what it lacks may go by them. The force
that the model expects carries the noise of an acceleration, twice differentiated: residuals lean
on it by that noise alone, and so they are held against the force that was read.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Track
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout


class Course(NamedTuple):
    """A measured motion; all (nodes,), SI.

    - `times`. - `position`, `speed`, `pressure`: the last is 0 where none was read.
    """

    times: Float[np.ndarray, " nodes"]
    position: Float[np.ndarray, " nodes"]
    speed: Float[np.ndarray, " nodes"]
    pressure: Float[np.ndarray, " nodes"]


def course_of(track: Track) -> Course | None:
    """Return the motion of a record; None where it is simulated."""
    along = track.along
    if along is None:
        return None
    position, speed, pressure = (
        np.asarray(one) for one in (along.position, along.velocity, along.pressure)
    )
    return Course(
        float(along.first) + along.interval * np.arange(len(position)), position, speed, pressure
    )


def courses(problem: Problem) -> list[Course]:
    """Return all measured motions of a problem."""
    found = (course_of(track) for track in problem.tracks)
    return [one for one in found if one is not None]


def followed(course: Course, times: Float[np.ndarray, " m"]) -> Mapping[str, np.ndarray]:
    """Return what a residual at some times may go by (m,), by name; what stays is left out."""
    values = {"position": course.position, "speed": course.speed, "pressure": course.pressure}
    return {
        name: np.interp(times, course.times, series)
        for name, series in values.items()
        if np.ptp(series) > 0.0
    }


def measured(layout: Layout) -> Bool[np.ndarray, " n"]:
    """Which samples are forces of a measured motion."""
    problem = layout.problem
    along = [problem.track(channel.track).along is not None for channel in layout.channels]
    return np.array(along)[layout.channel]


def held_against(local: LocalFit) -> Float[np.ndarray, " n"]:
    """What a sensor's error may go by: what is expected; of a measured motion, what was read."""
    read = local.reading + local.residual
    return np.where(measured(local.layout), read, local.reading)
