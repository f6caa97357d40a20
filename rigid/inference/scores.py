"""Slopes of the samples' log-likelihood, and what their correlation does to their weights."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.io.compiled import compiled
from rigid.likelihood.correlation import noise_law
from rigid.likelihood.noise_spectrum import NoiseLaw
from rigid.likelihood.problem import Problem, evaluate, in_batches, predict


def scores(problem: Problem, z: np.ndarray) -> list[np.ndarray]:
    """Slope of every sample's log-likelihood by its expected reading at z (size,), by piece."""
    [(predictions, _)] = in_batches(predict, problem, z[None])
    [(found, _)] = in_batches(evaluate, problem, z[None])
    read = [{name: series[..., :1] for name, series in group.items()} for group in predictions]
    sensors = {label: law[:2, :1] for label, law in found.sensors.items()}
    return [np.asarray(s) for s in _slopes(problem, read, sensors, jnp.asarray(z))]


@compiled
def _slopes(problem: Problem, predictions: list, sensors: dict, z: Array) -> list[Array]:
    """Slopes given the readings of one walker and its sensors' gains and zeros (2, 1)."""
    values = problem.parameters.values(z[None])
    out = []
    for piece in problem.pieces:
        m, sigma = piece.reading(predictions), piece.sigma(values)
        best = jnp.stack([sensors[piece.sensor(i)] for i in range(len(piece.tracks))])
        r = piece.data[..., None] - (1.0 + best[:, 0]) * m - best[:, 1]
        out.append(piece.sheet.noise_model(sigma)(r).slope[..., 0])
    return out


def residuals(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Recorded less expected at z (size,), in the order of `set_aside.readings_of` (n,)."""
    [(predictions, _)] = in_batches(predict, problem, z[None])
    [(found, _)] = in_batches(evaluate, problem, z[None])
    out = []
    for piece in problem.pieces:
        for i, track in enumerate(piece.tracks):
            gain, zero = found.sensors[piece.sensor(i)][:2, 0]
            reading = predictions[piece.group][piece.quantity][:, track, 0]
            out.append(np.asarray(piece.data)[:, i] - (1.0 + gain) * reading - zero)
    return np.concatenate(out)


def score_correlation(problem: Problem, z: np.ndarray) -> dict[tuple[int, str, int], NoiseLaw]:
    """Law of the scores of every channel at z, by (group, quantity, track)."""
    out = {}
    for piece, score in zip(problem.pieces, scores(problem, z), strict=True):
        for i, track in enumerate(piece.tracks):
            out[piece.group, piece.quantity, track] = noise_law(
                score[:, i], np.asarray(piece.weight)[:, i] > 0
            )
    return out


def weighted(problem: Problem, correlation: Mapping[tuple[int, str, int], NoiseLaw]) -> Problem:
    """Return the problem with its weights divided by the correlation time of each channel."""
    return problem.with_weights(
        {
            (p.group, p.quantity): np.asarray(p.weight)
            / np.array([correlation[p.group, p.quantity, t].time for t in p.tracks])
            for p in problem.pieces
        }
    )
