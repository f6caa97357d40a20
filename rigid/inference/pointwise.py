"""Log-likelihood of short stretches of every channel, for cross-validation that leaves them out."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.inference.search import Found
from rigid.io.compiled import compiled
from rigid.likelihood.noise import total
from rigid.likelihood.problem import Problem, in_batches, predict

LEAST_SAMPLES = 128
"""Of a block: as many blocks as say something, and a file that stays small."""

TIMES_APART = 4.0
"""Correlation times that a block lasts at least, so that what is left says little of it."""


class Stretch(NamedTuple):
    """Where a block stands: `channel` "record,cylinder", its `quantity`, the time it begins [s]."""

    channel: str
    quantity: str
    begins: float


class Blocks(NamedTuple):
    """Log-likelihoods of blocks: `stretches` tells where each is, `values` (n, blocks)."""

    stretches: tuple[Stretch, ...]
    values: np.ndarray


def blocks(found: Found, z: np.ndarray, sensors: Mapping[str, np.ndarray]) -> Blocks:
    """Return the log-likelihood of every block for z (n, size).

    - `sensors`: gain and zero (2, n) of each sensor, drawn with z.
    """
    problem, lengths = found.problem, _lengths(found)
    size, labels = problem.parameters.size, tuple(sensors)
    columns = np.concatenate([z, *(sensors[label].T for label in labels)], axis=1)

    def program(problem: Problem, rows: Array) -> Array:
        here = rows[:, :size]
        faults = {s: rows[:, size + 2 * i :][:, :2] for i, s in enumerate(labels)}
        return _sums(problem, predict(problem, here), here, faults, lengths)

    parts = in_batches(program, problem, columns)
    values = np.concatenate([part[:, :n] for part, n in parts], axis=1).T
    stretches = _stretches(problem, lengths)
    read = np.array([stretch is not None for stretch in stretches])
    return Blocks(tuple(s for s in stretches if s is not None), values[:, read])


def _lengths(found: Found) -> tuple[int, ...]:
    """Samples of a block, by piece."""
    out = []
    for piece in found.problem.pieces:
        memories = [found.correlation[piece.group, piece.quantity, t] for t in piece.tracks]
        longest = max(memory.time for memory in memories)
        wanted = max(LEAST_SAMPLES, math.ceil(TIMES_APART * longest))
        out.append(min(wanted, piece.data.shape[0]))
    return tuple(out)


@compiled
def _sums(
    problem: Problem, predictions: list, z: Array, faults: dict[str, Array], lengths: tuple
) -> Array:
    """Sums of the samples' log-likelihoods over blocks, (blocks, walkers), piece by piece.

    - `faults`: gain and zero (walkers, 2) by sensor.
    """
    values, out = problem.parameters.values(z), []
    for piece, length in zip(problem.pieces, lengths, strict=True):
        law = piece.sheet.noise_model(piece.sigma(values))
        fault = jnp.stack([faults[piece.sensor(i)] for i in range(len(piece.tracks))])
        reading = (1.0 + fault[..., 0]) * piece.reading(predictions) + fault[..., 1]
        terms = piece.weight[..., None] * law(piece.data[..., None] - reading).value
        count = -(-terms.shape[0] // length)
        room = ((0, count * length - terms.shape[0]), (0, 0), (0, 0))
        parted = jnp.pad(terms, room).reshape(count, length, *terms.shape[1:])
        out.append(jax.vmap(total)(parted).reshape(-1, terms.shape[-1]))
    return jnp.concatenate(out)


def _stretches(problem: Problem, lengths: tuple[int, ...]) -> list[Stretch | None]:
    """Where the blocks of `_sums` stand; None where nothing was read."""
    out = []
    for piece, length in zip(problem.pieces, lengths, strict=True):
        tracks = [problem.groups[piece.group].tracks[i] for i in piece.tracks]
        weight = np.asarray(piece.weight)
        for begin in range(0, len(weight), length):
            for i, track in enumerate(tracks):
                there = weight[begin : begin + length, i].any()
                at = float(track.first) + track.interval * begin
                out.append(Stretch(track.label, piece.quantity, at) if there else None)
    return out
