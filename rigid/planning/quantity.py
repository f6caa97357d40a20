"""A quantity that a next record is to tell: its values, and how it hangs on a fit's numbers."""

import dataclasses
import re
from collections.abc import Callable, Iterable

import numpy as np
from jaxtyping import Float

from rigid.inference.derived import frictions, values_of
from rigid.inference.friction_curve import FREQUENCIES
from rigid.inference.newton import is_noise
from rigid.io.errors import InputError
from rigid.likelihood.problem import Problem
from rigid.spec.sentences import unknown

MAGNITUDE = re.compile(r"abs_mu\[(?P<hertz>[0-9.eE+-]+) Hz(?:,(?P<view>.+))?\]")
STEP = 1e-3
"""Of z, for slopes by central differences."""

USUAL = ("k_LC", "abs_mu[80 Hz]")
"""Quantities where none are asked for, as far as a model has them."""

Values = Callable[[Float[np.ndarray, "n size"]], Float[np.ndarray, " n"]]
"""Values (n,) in SI at z (n, size)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Quantity:
    """What a record is to tell.

    - `values`: at points of the posterior. - `unit`. - `sensors` (2 sensors,): slope by gains and
      zeros on their standard scale; None: it does not hang on them. - `stays`: part of its
      variance that no record of the campaign's kinds takes away.
    """

    values: Values
    unit: str
    sensors: Float[np.ndarray, " ends"] | None = None
    stays: float = 0.0

    def slope(self, problem: Problem, z: Float[np.ndarray, " size"]) -> Float[np.ndarray, " ends"]:
        """Slope by the numbers of a problem, then by gains and zeros of its sensors."""
        ends = np.zeros(2 * len(problem.sensors)) if self.sensors is None else self.sensors
        return np.concatenate([slope(self.values, z)[~is_noise(problem)], ends])


def usual(problem: Problem) -> tuple[str, ...]:
    """Names of the quantities of USUAL, or of all numbers that records share where it has none."""
    views = frictions(problem, values_of(problem, np.zeros((1, problem.parameters.size))))
    known = {*problem.parameters.labels, *_magnitudes(views)}
    found = tuple(name for name in USUAL if name in known)
    shared = (p.label for p in problem.parameters.sampled if p.base != "noise" and not p.record)
    return found or tuple(shared)


def quantity_of(problem: Problem, name: str, where: str) -> Quantity:
    """Return a quantity by its name in a fit's table: a parameter, or `abs_mu[80 Hz]`.

    Raises InputError where nothing answers to the name.
    """
    if name in problem.parameters.labels:
        (unit,) = (p.unit for p in problem.parameters.sampled if p.label == name)
        return Quantity(lambda z: values_of(problem, z)[name], unit)
    views = frictions(problem, values_of(problem, np.zeros((1, problem.parameters.size))))
    asked = MAGNITUDE.fullmatch(name)
    view = (asked["view"] or "") if asked else ""
    if asked is None or view not in views:
        known = [*problem.parameters.labels, *_magnitudes(views)]
        raise InputError(f"{where}: {unknown('quantity', name, known)}")
    log_hertz = float(np.log(_hertz(asked["hertz"], name, where)))

    def magnitude(z: Float[np.ndarray, "n size"]) -> Float[np.ndarray, " n"]:
        curve = np.log(frictions(problem, values_of(problem, z))[view].magnitude)
        grid = np.log(FREQUENCIES)
        return np.exp(np.array([np.interp(log_hertz, grid, row) for row in curve]))

    return Quantity(magnitude, "N s/m")


def _magnitudes(views: Iterable[str]) -> list[str]:
    return [f"abs_mu[80 Hz{',' + view if view else ''}]" for view in views]


def _hertz(text: str, name: str, where: str) -> float:
    least, most = float(FREQUENCIES[0]), float(FREQUENCIES[-1])
    try:
        found = float(text)
    except ValueError:
        found = np.nan
    if not least <= found <= most:
        raise InputError(
            f"{where}: {name}: a frequency between {least:g} and {most:g} Hz is asked for"
        )
    return found


def slope(values: Values, z: Float[np.ndarray, " size"]) -> Float[np.ndarray, " size"]:
    """Slope of values by the entries of z."""
    steps = STEP * np.eye(len(z))
    up, down = np.split(values(np.concatenate([z + steps, z - steps])), 2)
    return (up - down) / (2.0 * STEP)
