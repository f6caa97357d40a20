"""The likelihood of all samples with gain and zero of every sensor integrated out.

Pieces of one shape take turns in one program, each a block of samples at a time.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from functools import partial, reduce
from operator import add
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from rigid.likelihood import noise
from rigid.likelihood.channels import Piece
from rigid.likelihood.noise import Spread

Tree = TypeVar("Tree")

FAR = 1e6
"""Readings so many times larger than what was read, root mean square, are those of a solve that
blew up. Beyond some 1e8 nothing is left of the data in sums of squares, and what rounding leaves of
them has made log-likelihoods of +1e98."""

BLOCK = 64
"""Samples summed at a time; a block of all tracks and walkers stays in the processor's cache."""


class Turn(NamedTuple):
    """One piece among those of its shape: arrays alone, so that all of them share a program.

    - `step`: of the converter. - `data`, `weight` (samples, tracks). - `sigma` (tracks, walkers):
      noise. - `reading` (samples, tracks, walkers).
    """

    step: Array
    data: Array
    weight: Array
    sigma: Array
    reading: Array

    def summed(self, terms: Callable) -> tuple[Array, ...]:
        """Sum `terms(data, weight, reading)` over all samples, a block of them at a time.

        - `terms`: returns a tuple of arrays (tracks, walkers), summed over the first axis of its
          arguments.
        """
        blocks = -(-self.data.shape[0] // BLOCK)
        room = blocks * BLOCK - self.data.shape[0]

        def cut(series: Array) -> Array:
            padded = jnp.pad(series, ((0, room),) + ((0, 0),) * (series.ndim - 1))
            return padded.reshape(blocks, BLOCK, *series.shape[1:])

        series = (self.data[..., None], self.weight[..., None], self.reading)
        like = jax.eval_shape(terms, *(s[:1] for s in series))
        start = tuple(jnp.zeros(x.shape) for x in like)

        def more(sums: tuple, block: tuple) -> tuple:
            return tuple(a + b for a, b in zip(sums, terms(*block), strict=True))

        def one(sums: tuple, block: tuple) -> tuple[tuple, None]:
            # Records end before their grid does.
            read = jnp.any(block[1] > 0.0)
            return jax.lax.cond(read, more, lambda sums, _: sums, sums, block), None

        return jax.lax.scan(one, start, tuple(cut(s) for s in series))[0]


class Turns(NamedTuple):
    """Pieces of one shape and one law of samples.

    - `members`: their numbers. - `rounded`: whether their samples are intervals.
    - `each`: their arrays, stacked.
    """

    members: tuple[int, ...]
    rounded: bool
    each: Turn

    def map(self, function: Callable, *given: tuple) -> list:
        """Return `function(turn, *given)` of every member, of what is `given` its own row."""
        found = jax.lax.map(lambda one: function(*one), (self.each, *given))
        return [jax.tree.map(lambda a, i=i: a[i], found) for i in range(len(self.members))]


def in_turns(
    pieces: tuple[Piece, ...], predictions: list[dict[str, Array]], values: Mapping[str, Array]
) -> list[Turns]:
    """Put pieces of one shape together, by the law of their samples."""
    alike: dict[tuple, list[int]] = {}
    for number, piece in enumerate(pieces):
        alike.setdefault((piece.data.shape, piece.sheet.rounded), []).append(number)
    found = []
    for (_, rounded), members in alike.items():
        each = [
            Turn(
                jnp.asarray(pieces[i].sheet.step),
                pieces[i].data,
                pieces[i].weight,
                pieces[i].sigma(values),
                pieces[i].reading(predictions),
            )
            for i in members
        ]
        found.append(Turns(tuple(members), rounded, _stacked(each)))
    return found


def _stacked(trees: Iterable[Tree]) -> Tree:
    """Trees of arrays as one, with a first axis for them."""
    return jax.tree.map(lambda *rows: jnp.stack(rows), *trees)


def _by_sensor(pieces: tuple[Piece, ...], found: Mapping[int, Tree]) -> dict[str, Tree]:
    """Sum what was found of every piece, (tracks, walkers) each, over the tracks of each sensor."""
    out: dict[str, Tree] = {}
    for number, piece in enumerate(pieces):
        for i, label in enumerate(piece.sensors):
            mine = jax.tree.map(lambda a, i=i: a[i], found[number])
            out[label] = jax.tree.map(add, out[label], mine) if label in out else mine
    return out


def _calibrations(
    pieces: tuple[Piece, ...], turns: list[Turns]
) -> tuple[dict[str, noise.Calibration], Array]:
    """Return every sensor's most probable gain and zero under Gaussian noise, (walkers,).

    And whether readings are near enough to the data for a likelihood, (walkers,).
    """

    def sums(one: Turn) -> tuple[noise.Sums, Array]:
        variance = one.sigma**2 + one.step**2 / 12.0
        found = noise.Sums(*(x / variance for x in one.summed(noise.moments)))
        read = jnp.sum(one.weight * one.data**2, axis=0)[:, None] / variance
        return found, jnp.all(found.mm <= FAR**2 * (read + found.one), axis=0)

    each = {i: x for some in turns for i, x in zip(some.members, some.map(sums), strict=True)}
    spreads, found = spreads_of(pieces), {i: x for i, (x, _) in each.items()}
    return {
        label: noise.least_squares(total, spreads[label])
        for label, total in _by_sensor(pieces, found).items()
    }, reduce(jnp.logical_and, (near for _, near in each.values()))


def spreads_of(pieces: tuple[Piece, ...]) -> dict[str, Spread]:
    """Prior spreads of gain and zero, by label of the sensor."""
    return {label: piece.sheet.spread for piece in pieces for label in piece.sensors}


@dataclasses.dataclass(frozen=True)
class MarginalLikelihood:
    """Log-likelihood with gains and zeros integrated out, and what came of the sensors.

    - `value` (walkers,). - `sensors`: marginal law of each sensor's gain and zero.
    - `tracks`: by (group, track), the log-likelihood of its samples at the expansion point.
    """

    value: Array
    sensors: dict[str, noise.Marginal]
    tracks: dict[tuple[int, int], Array]


def marginal_likelihood(
    pieces: tuple[Piece, ...], predictions: list[dict[str, Array]], values: Mapping[str, Array]
) -> MarginalLikelihood:
    """Integrate gain and zero of every sensor out of the likelihood of all samples.

    Where readings are FAR from the data its value is -inf.
    """
    turns = in_turns(pieces, predictions, values)
    (at, near), spreads = _calibrations(pieces, turns), spreads_of(pieces)
    found: dict[int, noise.Quadratic] = {}
    for some in turns:

        def expanded(
            one: Turn, near: noise.Calibration, rounded: bool = some.rounded
        ) -> noise.Quadratic:
            law = noise.sample_law(one.sigma, one.step, rounded)
            return noise.Quadratic(*one.summed(partial(noise.quadratic, law, *near)))

        here = _stacked(_stacked(at[label] for label in pieces[i].sensors) for i in some.members)
        found |= dict(zip(some.members, some.map(expanded, here), strict=True))
    tracks: dict[tuple[int, int], Array] = {}
    for number, piece in enumerate(pieces):
        for i, track in enumerate(piece.tracks):
            key = (piece.group, track)
            tracks[key] = tracks.get(key, 0.0) + found[number].value[i]
    sensors = {
        label: noise.marginal(expansion, at[label], spreads[label])
        for label, expansion in _by_sensor(pieces, found).items()
    }
    value = reduce(add, (s.value for s in sensors.values()))
    return MarginalLikelihood(jnp.where(near, value, -jnp.inf), sensors, tracks)
