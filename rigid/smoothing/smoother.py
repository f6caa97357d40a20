"""A record through the smoother: forward over its blocks and back again."""

from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.rig import Rig
from rigid.smoothing import kalman
from rigid.smoothing.field import BLOCK, NODE, Field, node_places, reference
from rigid.smoothing.kalman import Backward, Filtered, Run, Samples, Smoothed
from rigid.smoothing.model import LATENT_SCALES, Calibration, Nodes, Reference, nodes, scales, shown

STEPS = 4
"""Steps from one sample to the next: the load is told every 2.5 ms at 100 Hz."""

REST = 1e-3
"""Sd of the state at the first sample, in units of scales: the record begins at rest."""

FIRST_LOAD, FIRST_SLOPE, FIRST_KAPPA = 1.0, 1e3, 0.3
"""Sd of ice load [N], slope [N/s] and kappa [-] at the first sample."""


class Draws(NamedTuple):
    """A batch of draws on the last axis: `rig` parameters (..., draws), `sensors` (3, draws)."""

    rig: Rig
    sensors: Calibration


class Evidence(NamedTuple):
    """Readings as Gaussians, which all draws share, and how the load may move.

    - `reading`, `variance` (samples, 3) SI. - `moves` (samples, 3), or (draws, samples, 3) where
      draws differ: variance a step, in units of scales.
    """

    reading: np.ndarray
    variance: np.ndarray
    moves: np.ndarray


@eqx.filter_jit
def _tables(draws: Draws, path: Reference, length: float) -> Nodes:
    """Nodes of a block for a batch of draws."""
    return jax.vmap(lambda d: nodes(d.rig, path, d.sensors, length), in_axes=-1)(draws)


@eqx.filter_jit
def _start(draws: Draws, keys: Array) -> tuple[Filtered, Array]:
    """What is known before the first sample, and the rows that show a state."""

    def one(draw: Draws, key: Array) -> tuple[Filtered, Array]:
        size = scales(draw.rig)
        n = size.shape[0]
        first = jnp.array([FIRST_LOAD, FIRST_SLOPE, FIRST_KAPPA]) / jnp.array(LATENT_SCALES)
        sd = jnp.full(n, REST).at[n - 3 :].set(first)
        path = sd * jax.random.normal(jax.random.fold_in(key, 2**31 - 1), (n,))
        return _unread(n, sd, path), shown(draw.rig)

    state, rows = jax.vmap(one, in_axes=(-1, 0))(draws, keys)
    return state, rows[0]


def _unread(n: int, sd: Array, path: Array) -> Filtered:
    return Filtered(jnp.zeros((n, kalman.COLUMNS)), jnp.diag(sd**2), path, jnp.zeros(()))


def filtered(field: Field, draws: Draws, evidence: Evidence, keys: Array) -> list[Filtered]:
    """Filter a record for a batch of draws: the state before each block and after the last.

    - `keys` (draws, ...): of the simulated errors.
    """
    path, blocks = reference(field), _blocks(field, evidence)
    state, rows = _start(draws, keys)
    out = [state]
    for number, block in enumerate(blocks):
        run = _run(field, draws, (path, evidence, keys), block, number)
        out.append(kalman.forward(out[-1], run, rows, STEPS))
    return out


def smooth(
    field: Field, draws: Draws, evidence: Evidence, keys: Array
) -> Iterator[tuple[int, Smoothed]]:
    """Smooth a record for a batch of draws; gives its blocks from the last to the first.

    Yields the first sample of each block and (draws, samples, ...) arrays, padded in the last.
    """
    yield from smoothed(field, draws, evidence, keys, filtered(field, draws, evidence, keys))


def smoothed(
    field: Field, draws: Draws, evidence: Evidence, keys: Array, begins: list[Filtered]
) -> Iterator[tuple[int, Smoothed]]:
    """Go back over a record that `filtered` went through, as `smooth` does."""
    path, blocks = reference(field), _blocks(field, evidence)
    _, rows = _start(draws, keys)
    count, n = begins[0].path.shape
    later = Backward(jnp.zeros((count, n, kalman.COLUMNS)), jnp.zeros((count, n, n)))
    for number in reversed(range(field.blocks)):
        run = _run(field, draws, (path, evidence, keys), blocks[number], number)
        later, found = kalman.backward(later, begins[number], run, rows, STEPS)
        yield number * BLOCK, found


def _run(
    field: Field,
    draws: Draws,
    shared: tuple[Reference, Evidence, Array],
    block: Samples,
    number: int,
) -> Run:
    """Everything of one block for a batch of draws."""
    path, evidence, keys = shared
    here = slice(number * BLOCK // NODE, (number + 1) * BLOCK // NODE + 1)
    part = Reference(*(jnp.asarray(p[here]) for p in path))
    table = _tables(draws, part, field.interval / STEPS)
    moves = np.zeros((len(keys), BLOCK, 3))
    given = evidence.moves[..., number * BLOCK : (number + 1) * BLOCK, :]
    moves[:, : given.shape[-2]] = given
    return Run(block, jnp.asarray(moves), table, keys)


def _blocks(field: Field, evidence: Evidence) -> list[Samples]:
    node, place = node_places()
    reading, variance, known = (
        field.padded(v) for v in (evidence.reading, evidence.variance, field.known)
    )
    out = []
    for number in range(field.blocks):
        here = slice(number * BLOCK, (number + 1) * BLOCK)
        index = np.arange(number * BLOCK, (number + 1) * BLOCK)
        out.append(
            Samples(
                jnp.asarray(node),
                jnp.asarray(place),
                jnp.asarray(reading[here]),
                jnp.asarray(variance[here]),
                jnp.asarray(known[here]),
                jnp.asarray(index),
            )
        )
    return out
