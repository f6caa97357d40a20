"""A fit around an optimum held against diffrax, at its best point and draws of its Gaussian."""

import dataclasses
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

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

    Noise levels stay at those of the fit; samples count as they do there. What was absorbed moves
    readings both ways.
    """
    hypothesis, family = local.hypothesis, local.family
    if nothing_solved(hypothesis.problem):
        return None
    absorbed = [np.arange(here.start, here.stop) for here, *_ in hypothesis.latent(local.w)]
    drawn = np.concatenate([np.arange(len(hypothesis.parameters)), *absorbed])
    rng = np.random.default_rng([seed, 4])
    spread = np.linalg.cholesky(np.linalg.inv(local.information)[np.ix_(drawn, drawn)])
    moved = rng.standard_normal((POINTS, len(drawn))) @ spread.T
    moved[0] = 0.0
    w = np.tile(local.w, (POINTS, 1))
    w[:, drawn] += moved
    problem = dataclasses.replace(local.layout.weighed_problem, groups=family.groups)

    def exact(given: dict[str, Array]) -> Predictions:
        return by_diffrax(problem, given, tolerance)

    def fast(given: dict[str, Array]) -> Predictions:
        return read(family, {label: np.asarray(v) for label, v in given.items()})

    def first(count: int) -> SolverCheck:
        values = _values(local, w[:count])
        by_steps, by_solve = (
            _with_absorbed(local, w[:count], _confined(hypothesis, problem.groups, values, way))
            for way in (fast, exact)
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


def _with_absorbed(
    local: LocalFit, w: Float[np.ndarray, "points size"], found: Predictions
) -> Predictions:
    """Predictions that what was absorbed has moved; without it a fit is not near its records."""
    hypothesis, layout = local.hypothesis, local.layout
    if not hypothesis.absorbed:
        return found
    latent = hypothesis.latent(local.w)
    change = np.sum([one.columns @ w[:, here].T for here, one, _ in latent], axis=0)
    gain = (hypothesis.sensors(local.w) * layout.spreads)[layout.sensor, 0]
    change, at = change / (1.0 + gain[:, None]), 0
    moved = [{quantity: np.array(series) for quantity, series in one.items()} for one in found]
    for piece in layout.problem.pieces:
        size, tracks = piece.data.size, list(piece.tracks)
        here = change[at : at + size].reshape(len(tracks), -1, len(w))
        moved[piece.group][piece.quantity][:, tracks] += here.swapaxes(0, 1)
        at += size
    return moved
