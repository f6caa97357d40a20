"""Likelihoods broken on purpose, to show that a validation sees it."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from rigid.likelihood.parameters import Parameters
from rigid.likelihood.priors import Normal
from rigid.likelihood.problem import Problem


def broken(problem: Problem, how: str | None, z: np.ndarray) -> Problem:
    """Return a problem with a likelihood that is broken.

    - `how`: one of design.BREAKS; None, and "colour-ignored", which is a fault of the fit, leave
      the problem as it is. - `z` (size,): the truth.
    """
    if how == "noise-halved":
        return _with_half_the_noise(problem, z)
    if how == "rounding-ignored":
        return _without_rounding(problem)
    if how == "record-twice":
        return _with_a_record_twice(problem)
    return problem


def kept(problem: Problem, z: np.ndarray, whole: Problem) -> np.ndarray:
    """Entries of z (size of `whole`,) that a problem still has."""
    return z[[whole.parameters.index(label) for label in problem.parameters.labels]]


def _with_half_the_noise(problem: Problem, z: np.ndarray) -> Problem:
    """Noise levels known to be half of what they are."""
    parameters = problem.parameters
    level = parameters.values(jnp.asarray(z[None]))
    known = tuple(
        dataclasses.replace(p, prior=Normal(0.5 * level[p.label][0], jnp.asarray(0.0)))
        for p in parameters.sampled
        if p.base == "noise"
    )
    left = tuple(p for p in parameters.sampled if p.base != "noise")
    new = Parameters(left, parameters.known + known)
    return eqx.tree_at(lambda q: q.parameters, problem, new)


def _without_rounding(problem: Problem) -> Problem:
    """Readings taken for what the sensor gave before its converter."""
    pieces = tuple(
        dataclasses.replace(p, sheet=dataclasses.replace(p.sheet, step=0.0)) for p in problem.pieces
    )
    return dataclasses.replace(problem, pieces=pieces)


def _with_a_record_twice(problem: Problem) -> Problem:
    """The first record counts twice."""
    group, place = 0, 0
    pieces = []
    for piece in problem.pieces:
        weight = np.array(piece.weight)
        if piece.group == group and place in piece.tracks:
            weight[:, piece.tracks.index(place)] *= 2.0
        pieces.append(dataclasses.replace(piece, weight=weight))
    return dataclasses.replace(problem, pieces=tuple(pieces))
