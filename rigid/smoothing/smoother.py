"""A record through the smoother: forward over its blocks and back again."""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.io.compiled import compiled
from rigid.smoothing import kalman
from rigid.smoothing.field import BLOCK, Field, node_places, rough
from rigid.smoothing.interval import Interval, intervals
from rigid.smoothing.kalman import Backward, BlockRun, Filtered, Samples, Smoothed
from rigid.smoothing.model import Calibration, nodes, scales, shown
from rigid.smoothing.plant import AbstractPlant, Rough
from rigid.smoothing.states import States

STEPS = 4
"""Steps from one sample to the next: the load is told every 2.5 ms at 100 Hz."""

REST = 1e-3
"""Sd of the state at the first sample, in units of scales: the record begins at rest."""


class DrawBatch(NamedTuple):
    """A batch of draws on the last axis: `plant` (..., draws), `sensors` (channels, draws)."""

    plant: AbstractPlant
    sensors: Calibration


class Evidence(NamedTuple):
    """Readings as Gaussians, which all draws share, and how the load may move.

    - `reading`, `variance` (samples, channels) SI. - `moves` (samples, inputs), or (ways, samples,
      inputs): variance a step, in units of scales, the same for all draws or several ways for one
      draw.
    """

    reading: np.ndarray
    variance: np.ndarray
    moves: np.ndarray


class Keeping(NamedTuple):
    """Where is kept how far the draws are, and who is told of blocks, forward and back."""

    shelf: Shelf
    report: Callable[[int], None]


NOWHERE = Keeping(NOTHING_KEPT, lambda _: None)


@compiled
def _tables(draws: DrawBatch, path: Rough, length: float) -> Interval:
    """Nodes of a block for a batch of draws."""

    def one(draw: DrawBatch) -> Interval:
        return intervals(nodes(draw.plant, path, draw.sensors, length), shown(draw.plant), STEPS)

    return jax.vmap(one, in_axes=-1)(draws)


@compiled
def _start(draws: DrawBatch, keys: Array | None, ways: int) -> Filtered:
    """What is known before the first sample; `keys` as in `filtered`, `ways` of one draw."""

    def one(draw: DrawBatch, key: Array | None) -> Filtered:
        n, inputs = scales(draw.plant).shape[0], draw.plant.inputs
        first = jnp.asarray(inputs.first)
        sd, path = jnp.full(n, REST).at[n - inputs.count :].set(first), jnp.zeros(n)
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


def filtered(
    field: Field,
    draws: DrawBatch,
    evidence: Evidence,
    keys: Array | None,
    start: Filtered | None = None,
) -> list[Filtered]:
    """Filter a record for a batch of draws: the state before each block and after the last.

    - `keys` (draws, ...): of the simulated errors, or None where there are to be none. - `start`:
      what is known before the first sample, where the field is part of a record.
    """
    ways = _ways(evidence)
    out = [_start(draws, keys, ways) if start is None else _wide(start, ways)]
    for run in _runs(field, draws, evidence, keys):
        out.append(kalman.forward(out[-1], run))
    return out


def last_state(field: Field, draws: DrawBatch, evidence: Evidence) -> Filtered:
    """Filter a record without simulated errors; gives what is known after its last block."""
    state = _start(draws, None, _ways(evidence))
    for run in _runs(field, draws, evidence, None):
        state = kalman.forward(state, run)
    return state


class Back:
    """A batch of draws on its way back over a record, block by block.

    Between two blocks it holds what the later samples say (`later`), and no series. The states
    before each block are filtered when it is made, and kept on disk.

    - `left`: blocks to go, None: all. - `later`: what those behind them say.
    """

    def __init__(
        self,
        field: Field,
        draws: DrawBatch,
        evidence: Evidence,
        keys: Array | None,
        keeping: Keeping = NOWHERE,
        left: int | None = None,
        later: Backward | None = None,
    ):
        self._given, self._report = (field, draws, evidence, keys), keeping.report
        state, self._begins = _start(draws, keys, _ways(evidence)), States(keeping.shelf.folder)
        left = field.blocks if left is None else left
        keeping.report(2 * (field.blocks - left))
        self._begins.append(state)
        for run in islice(_runs(*self._given), max(left - 1, 0)):
            state = kalman.forward(state, run)
            self._begins.append(state)
            keeping.report(1)
        nothing = Backward(jnp.zeros_like(state.mean), jnp.zeros_like(state.covariance))
        self.later = nothing if later is None else Backward(*map(jnp.asarray, later))
        self._path = rough(field)

    def block(self, number: int) -> Smoothed:
        """Smooth block `number`, each once, from the last to the first: (draws, samples, ...)."""
        run = _run(*self._given, self._path, number)
        self.later, found = kalman.backward(self.later, self._begins[number], run)
        self._report(1)
        if number == 0:
            self._begins.close()
        return found


def smooth(
    field: Field, draws: DrawBatch, evidence: Evidence, keys: Array | None
) -> Iterator[tuple[int, Smoothed]]:
    """Smooth a record for a batch of draws; gives its blocks from the last to the first.

    Yields the first sample of each block and (draws, samples, ...) arrays, padded in the last.
    """
    back = Back(field, draws, evidence, keys)
    for number in range(field.blocks)[::-1]:
        yield number * BLOCK, back.block(number)


def smoothed(
    field: Field, draws: DrawBatch, evidence: Evidence, keys: Array | None, begins: list[Filtered]
) -> Iterator[tuple[int, Smoothed, Backward]]:
    """Go back over a record, as `smooth` does; `begins`: what is known before each block.

    Yields what the samples from each block on say as well.
    """
    later = Backward(jnp.zeros_like(begins[0].mean), jnp.zeros_like(begins[0].covariance))
    path = rough(field)
    for number in range(field.blocks)[::-1]:
        run = _run(field, draws, evidence, keys, path, number)
        later, found = kalman.backward(later, begins[number], run)
        yield number * BLOCK, found, later


def _runs(
    field: Field, draws: DrawBatch, evidence: Evidence, keys: Array | None
) -> Iterator[BlockRun]:
    """Everything of each block for a batch of draws, from the first to the last."""
    path = rough(field)
    for number in range(field.blocks):
        yield _run(field, draws, evidence, keys, path, number)


def _run(
    field: Field,
    draws: DrawBatch,
    evidence: Evidence,
    keys: Array | None,
    path: Rough,
    number: int,
) -> BlockRun:
    """Everything of block `number` for a batch of draws; `path`: of the whole record."""
    node = field.setup.node
    here = slice(number * BLOCK // node, (number + 1) * BLOCK // node + 1)
    part = Rough(*(jnp.asarray(p[here]) for p in path))
    table = _wide(_tables(draws, part, field.interval / STEPS), _ways(evidence))
    moves = np.zeros((table.step.shape[0], BLOCK, evidence.moves.shape[-1]))
    given = evidence.moves[..., number * BLOCK : (number + 1) * BLOCK, :]
    moves[:, : given.shape[-2]] = given
    return BlockRun(_block(field, evidence, number), jnp.asarray(moves), table, keys)


def _ways(evidence: Evidence) -> int:
    return evidence.moves.shape[0] if evidence.moves.ndim == 3 else 1


def _block(field: Field, evidence: Evidence, number: int) -> Samples:
    """Readings of a block, padded with none."""
    index = np.arange(number * BLOCK, (number + 1) * BLOCK)

    def part(values: np.ndarray) -> Array:
        found = values[index[0] : index[-1] + 1]
        return jnp.asarray(np.pad(found, ((0, BLOCK - len(found)), (0, 0))))

    return Samples(
        place=jnp.asarray(node_places(field.setup.node)),
        reading=part(evidence.reading),
        variance=part(evidence.variance),
        known=part(field.known),
        number=jnp.asarray(index),
    )
