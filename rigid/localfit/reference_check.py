"""A fit around an optimum held against diffrax, at its best point and draws of its Gaussian."""

import dataclasses
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.inference.reference_check import (
    POINTS,
    Predictions,
    SolverCheck,
    by_diffrax,
    compared,
    nothing_solved,
    until_clear,
)
from rigid.likelihood.groups import AbstractGroup
from rigid.localfit.candidates import quiet_values
from rigid.localfit.families import read
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.local import LocalFit
from rigid.physics.full import TOLERANCE


def against_reference(
    local: LocalFit, seed: int, tolerance: float = TOLERANCE
) -> SolverCheck | None:
    """Solve a fit again by diffrax; None where there is nothing to solve.

    Noise levels stay at those of the fit; samples count as they do there.
    """
    hypothesis, family = local.hypothesis, local.family
    if nothing_solved(hypothesis.problem):
        return None
    size = len(hypothesis.parameters)
    rng = np.random.default_rng([seed, 4])
    spread = np.linalg.cholesky(np.linalg.inv(local.information)[:size, :size])
    moved = rng.standard_normal((POINTS, size)) @ spread.T
    moved[0] = 0.0
    w = np.tile(local.w, (POINTS, 1))
    w[:, :size] += moved
    problem = dataclasses.replace(local.layout.weighed_problem, groups=family.groups)

    def exact(given: dict[str, Array]) -> Predictions:
        return by_diffrax(problem, given, tolerance)

    def fast(given: dict[str, Array]) -> Predictions:
        return read(family, {label: np.asarray(v) for label, v in given.items()})

    def first(count: int) -> SolverCheck:
        values = _values(local, w[:count])
        by_steps, by_solve = (
            _confined(hypothesis, problem.groups, values, way) for way in (fast, exact)
        )
        return compared(problem, values, by_steps, by_solve, tolerance)

    return until_clear(first, POINTS)


def _values(local: LocalFit, w: np.ndarray) -> dict[str, Array]:
    """SI values (points,) by label; what the fit has not is absent."""
    hypothesis = local.hypothesis
    places = [hypothesis.values(one) for one in w]
    told = {label: np.array([p[label][0] for p in places]) for label in hypothesis.labels}
    sigmas = hypothesis.sigmas(local.z_noise)
    noise = {f"noise[{s}]": v for s, v in zip(hypothesis.problem.sensors, sigmas, strict=True)}
    known = dict(local.family.quiet) | hypothesis.constants() | noise
    still = {label: np.full(len(w), v) for label, v in known.items()}
    return {label: jnp.asarray(v, float) for label, v in (still | told).items()}


def _confined(
    hypothesis: Hypothesis,
    groups: tuple[AbstractGroup, ...],
    values: dict[str, Array],
    way: Callable[[dict[str, Array]], Predictions],
) -> Predictions:
    """Predictions by a way; an effect that is confined to a record is absent from all others."""
    found, points = way(values), len(next(iter(values.values())))
    for effect in hypothesis.added:
        record = hypothesis.only.get(effect.name)
        if record is None:
            continue
        absent = {label: jnp.full(points, v) for label, v in quiet_values(effect).items()}
        without = way(values | absent)
        for group, mine, other in zip(groups, found, without, strict=True):
            elsewhere = np.array([t.label != record for t in group.tracks])[:, None]
            for quantity in mine:
                mine[quantity] = np.where(elsewhere, other[quantity], mine[quantity])
    return found
