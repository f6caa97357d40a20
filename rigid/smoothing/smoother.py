"""A record through the smoother: forward over its blocks and back again."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.rig import Rig
from rigid.smoothing import kalman
from rigid.smoothing.field import BLOCK, NODE, Field, node_places, reference
from rigid.smoothing.interval import Interval, intervals
from rigid.smoothing.kalman import Backward, Filtered, Run, Samples, Smoothed
from rigid.smoothing.model import LATENT_SCALES, Calibration, Reference, nodes, scales, shown

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

    - `reading`, `variance` (samples, 3) SI. - `moves` (samples, 3), or (ways, samples, 3): variance
      a step, in units of scales, the same for all draws or several ways for one draw.
    """

    reading: np.ndarray
    variance: np.ndarray
    moves: np.ndarray


@eqx.filter_jit
def _tables(draws: Draws, path: Reference, length: float) -> Interval:
    """Nodes of a block for a batch of draws."""

    def one(draw: Draws) -> Interval:
        return intervals(nodes(draw.rig, path, draw.sensors, length), shown(draw.rig), STEPS)

    return jax.vmap(one, in_axes=-1)(draws)


@eqx.filter_jit
def _start(draws: Draws, keys: Array | None, ways: int) -> Filtered:
    """What is known before the first sample; `keys` as in `filtered`, `ways` of one draw."""

    def one(draw: Draws, key: Array | None) -> Filtered:
        size = scales(draw.rig)
        n = size.shape[0]
        first = jnp.array([FIRST_LOAD, FIRST_SLOPE, FIRST_KAPPA]) / jnp.array(LATENT_SCALES)
        sd, path = jnp.full(n, REST).at[n - 3 :].set(first), jnp.zeros(n)
        if key is not None:
            path = sd * jax.random.normal(jax.random.fold_in(key, 2**31 - 1), (n,))
        columns = 1 if key is None else kalman.COLUMNS
        return Filtered(jnp.zeros((n, columns)), jnp.diag(sd**2), path, jnp.zeros(()))

    return _wide(jax.vmap(one, in_axes=(-1, 0))(draws, keys), ways)


def _wide(tree: Any, ways: int) -> Any:
    """One draw for each way that its load may move; more draws as they are."""
    return jax.tree.map(
        lambda leaf: jnp.repeat(leaf, ways, axis=0) if leaf.shape[0] == 1 else leaf, tree
    )


def filtered(field: Field, draws: Draws, evidence: Evidence, keys: Array | None) -> list[Filtered]:
    """Filter a record for a batch of draws: the state before each block and after the last.

    - `keys` (draws, ...): of the simulated errors, or None where there are to be none.
    """
    out = [_start(draws, keys, _ways(evidence))]
    for run in _runs(field, draws, evidence, keys, range(field.blocks)):
        out.append(kalman.forward(out[-1], run))
    return out


def smooth(
    field: Field, draws: Draws, evidence: Evidence, keys: Array | None
) -> Iterator[tuple[int, Smoothed]]:
    """Smooth a record for a batch of draws; gives its blocks from the last to the first.

    Yields the first sample of each block and (draws, samples, ...) arrays, padded in the last.
    """
    begins = [_start(draws, keys, _ways(evidence))]
    for run in _runs(field, draws, evidence, keys, range(field.blocks - 1)):
        begins.append(kalman.forward(begins[-1], run))
    yield from smoothed(field, draws, evidence, keys, begins)


def smoothed(
    field: Field, draws: Draws, evidence: Evidence, keys: Array | None, begins: list[Filtered]
) -> Iterator[tuple[int, Smoothed]]:
    """Go back over a record, as `smooth` does; `begins`: what is known before each block."""
    later = Backward(jnp.zeros_like(begins[0].mean), jnp.zeros_like(begins[0].covariance))
    order = range(field.blocks)[::-1]
    runs = _runs(field, draws, evidence, keys, order)
    for number, run in zip(order, runs, strict=True):
        later, found = kalman.backward(later, begins[number], run)
        yield number * BLOCK, found


def _runs(
    field: Field, draws: Draws, evidence: Evidence, keys: Array | None, order: Iterable[int]
) -> Iterator[Run]:
    """Everything of some blocks for a batch of draws, in the order in which they are asked for."""
    path, blocks = reference(field), _blocks(field, evidence)
    for number in order:
        here = slice(number * BLOCK // NODE, (number + 1) * BLOCK // NODE + 1)
        part = Reference(*(jnp.asarray(p[here]) for p in path))
        table = _wide(_tables(draws, part, field.interval / STEPS), _ways(evidence))
        moves = np.zeros((table.step.shape[0], BLOCK, 3))
        given = evidence.moves[..., number * BLOCK : (number + 1) * BLOCK, :]
        moves[:, : given.shape[-2]] = given
        yield Run(blocks[number], jnp.asarray(moves), table, keys)


def _ways(evidence: Evidence) -> int:
    return evidence.moves.shape[0] if evidence.moves.ndim == 3 else 1


def _blocks(field: Field, evidence: Evidence) -> list[Samples]:
    place = node_places()
    reading, variance, known = (
        field.padded(v) for v in (evidence.reading, evidence.variance, field.known)
    )
    out = []
    for number in range(field.blocks):
        here = slice(number * BLOCK, (number + 1) * BLOCK)
        index = np.arange(number * BLOCK, (number + 1) * BLOCK)
        out.append(
            Samples(
                jnp.asarray(place),
                jnp.asarray(reading[here]),
                jnp.asarray(variance[here]),
                jnp.asarray(known[here]),
                jnp.asarray(index),
            )
        )
    return out
