"""Damped Newton steps to an optimum of the exact likelihood, gains and zeros of sensors included.

One compiled program returns the value, the gradient and the information matrix (scores and
curvatures of the samples, carried through the tangents of the simulation in forward mode, a
walker a tangent). The loop around it is Levenberg's and Marquardt's. Inside a general solver the
same program is compiled four times over: on two cores a Levenberg-Marquardt from a library took
112 s to compile and 16 s a start where this takes 11 s and 3 s.
"""

from functools import reduce
from operator import add
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid import noise
from rigid.likelihood import Piece
from rigid.problem import Problem

DAMPING = 1.0
EASE = 0.3
HARDEN = 2.5
MAX_DAMPING = 1e18
MAX_STEPS = 120
CLOSE = 1e-4
"""Converged when the next step promises less than this in log-posterior."""
LONGEST = 3.0
"""Largest change of an entry of z in one step: priors are of unit width."""


class Local(NamedTuple):
    """The negative log-posterior around a point of (z, standard gains and zeros), noise held.

    - `value`; `gradient` (n,); `information` (n, n): prior included.
    """

    value: Array | float
    gradient: Array | np.ndarray
    information: Array | np.ndarray


def is_noise(problem: Problem) -> np.ndarray:
    """Which entries of z are noise levels (size,)."""
    return np.array([p.base == "noise" for p in problem.parameters.sampled])


def joined(problem: Problem, z: np.ndarray, standard: np.ndarray) -> np.ndarray:
    """One vector of z, its noise levels left out, and gains and zeros (sensors, 2)."""
    return np.concatenate([np.asarray(z)[~is_noise(problem)], np.asarray(standard).ravel()])


def split(
    problem: Problem, w: Array | np.ndarray, z_noise: Array | np.ndarray
) -> tuple[Array, Array]:
    """Part the vector into z (size,), noise levels put in, and gains and zeros (sensors, 2)."""
    noisy = is_noise(problem)
    free = np.flatnonzero(~noisy)
    z = jnp.zeros(problem.parameters.size).at[free].set(w[: len(free)])
    return z.at[np.flatnonzero(noisy)].set(z_noise), jnp.asarray(w[len(free) :]).reshape(-1, 2)


@eqx.filter_jit
def local(problem: Problem, w: Array, z_noise: Array) -> Local:
    """Expand the negative log-posterior around w; noise levels `z_noise` are held."""
    z, standard = split(problem, w, z_noise)
    tangents = jnp.eye(len(z))[np.flatnonzero(~is_noise(problem))]
    base = jnp.broadcast_to(z, tangents.shape)

    def predict(z: Array) -> list[dict[str, Array]]:
        return problem.predict(problem.parameters.values(z))

    predictions, slopes = jax.jvp(predict, (base,), (tangents,))
    values = problem.parameters.values(z[None])
    prior = Local(0.5 * jnp.sum(w * w), w, jnp.eye(len(w)))
    parts = [
        _of_piece(problem, piece, (predictions, slopes), values, standard)
        for piece in problem.pieces
    ]
    return Local(*(reduce(add, terms) for terms in zip(prior, *parts, strict=True)))


def _of_piece(
    problem: Problem, piece: Piece, swept: tuple, values: dict[str, Array], standard: Array
) -> Local:
    """Add up the samples of one piece."""
    labels = [piece.sensor(i) for i in range(len(piece.tracks))]
    at = np.array([problem.sensors.index(label) for label in labels])
    spread = piece.sheet.spread
    gain, zero = standard[at, 0] * spread.gain, standard[at, 1] * spread.zero
    m = piece.reading(swept[0])[..., 0]
    slope = piece.reading(swept[1]) * (1.0 + gain)[:, None]
    law = noise.sample_law(piece.sigma(values)[:, 0], piece.sheet.step, piece.sheet.noise)
    point = law(piece.data - (1.0 + gain) * m - zero)
    own = jax.nn.one_hot(at, len(problem.sensors))
    by_gain = m[..., None] * spread.gain * own
    by_zero = jnp.broadcast_to(spread.zero * own, by_gain.shape)
    sensors = jnp.stack([by_gain, by_zero], axis=-1).reshape(*m.shape, -1)
    design = jnp.concatenate([slope, sensors], axis=-1).reshape(m.size, -1)
    score = (piece.weight * point.slope).ravel()
    bend = (-piece.weight * point.curvature).ravel()
    return Local(
        -jnp.sum(piece.weight * point.value),
        -design.T @ score,
        (design * bend[:, None]).T @ design,
    )


def descend(problem: Problem, w: np.ndarray, z_noise: np.ndarray) -> tuple[np.ndarray, Local]:
    """Lead w to an optimum; returns it and the expansion there, in NumPy.

    A point without a finite value is never accepted; the best point so far is returned when the
    steps are used up.
    """

    def expand(w: np.ndarray) -> Local:
        found = local(problem, jnp.asarray(w), jnp.asarray(z_noise))
        return Local(float(found.value), np.asarray(found.gradient), np.asarray(found.information))

    here, damping = expand(w), DAMPING
    for _ in range(MAX_STEPS):
        if not np.isfinite(here.value) or damping > MAX_DAMPING:
            break
        damping, step = _short_step(here, damping)
        if -0.5 * step @ here.gradient < CLOSE and damping <= DAMPING:
            break
        there = expand(w + step)
        if np.isfinite(there.value) and there.value < here.value:
            w, here, damping = w + step, there, damping * EASE
        else:
            damping *= HARDEN
    return w, here


def _short_step(here: Local, damping: float) -> tuple[float, np.ndarray]:
    """Return a step no longer than LONGEST, and the damping (in units of the prior) it takes."""
    unit = np.eye(len(here.gradient))
    while True:
        step = -np.linalg.solve(here.information + damping * unit, here.gradient)
        if np.max(np.abs(step)) <= LONGEST:
            return damping, step
        damping *= HARDEN
