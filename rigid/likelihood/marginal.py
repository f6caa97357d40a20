"""The likelihood of all samples with gain and zero of every sensor integrated out.

Pieces of one shape take turns in one program, each a block of samples at a time.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from functools import partial, reduce
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.likelihood import noise
from rigid.likelihood.channels import Piece
from rigid.likelihood.noise import Spreads

Tree = TypeVar("Tree")

FAR = 1e6
"""Readings so many times larger than what was read, root mean square, are those of a solve that
blew up. Beyond some 1e8 nothing is left of the data in sums of squares, and what rounding leaves of
them has made log-likelihoods of +1e98."""

CLOSE = 0.05
"""Nats by which an expansion in gain and zero may be wrong at the top that it promises. Of third
order it is at most some (2 promise)^(3/2) / 6 / sqrt(n), n samples telling the zero; steps of the
reference campaign's channels, 0.3 to 0.5 sds of noise, leave a tenth of that."""

SHORTER, MOST_TRIES = 0.25, 40
"""Of a step that leads down, the share that is tried next; steps in all."""

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

    - `members`: their numbers. - `nodes`: of the law of samples that are intervals; 0: a density.
    - `each`: their arrays, stacked.
    """

    members: tuple[int, ...]
    nodes: int
    each: Turn

    def map(self, function: Callable, *given: tuple | Array) -> list:
        """Return `function(turn, *given)` of every member, of what is `given` its own row."""
        found = jax.lax.map(lambda one: function(*one), (self.each, *given))
        return [jax.tree.map(lambda a, i=i: a[i], found) for i in range(len(self.members))]


def in_turns(
    pieces: tuple[Piece, ...], predictions: list[dict[str, Array]], values: Mapping[str, Array]
) -> list[Turns]:
    """Put pieces of one shape together, by the law of their samples."""
    alike: dict[tuple, list[int]] = {}
    for number, piece in enumerate(pieces):
        alike.setdefault((piece.data.shape, piece.sheet.nodes), []).append(number)
    found = []
    for (_, nodes), members in alike.items():
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
        found.append(Turns(tuple(members), nodes, _stacked(each)))
    return found


def _stacked(trees: Iterable[Tree]) -> Tree:
    """Trees of arrays as one, with a first axis for them."""
    return jax.tree.map(lambda *rows: jnp.stack(rows), *trees)


class Sensors(NamedTuple):
    """The sensors of all pieces.

    - `labels`; `spread`: prior sds of their gains and zeros, (sensors, 1) each.
    - `of`: by piece, which sensor read each of its tracks (tracks,).
    """

    labels: tuple[str, ...]
    spread: Spreads
    of: tuple[np.ndarray, ...]

    def summed(self, found: Mapping[int, Tree]) -> Tree:
        """Sum what was found of every piece, (tracks, walkers) each, to (sensors, walkers)."""
        places = np.concatenate([self.of[number] for number in found])

        def one(*parts: Array) -> Array:
            return jax.ops.segment_sum(jnp.concatenate(parts), places, len(self.labels))

        return jax.tree.map(one, *found.values())

    def on_tracks(self, values: Tree, number: int) -> Tree:
        """Return of `values`, (sensors, walkers) each, those of the tracks of a piece."""
        return jax.tree.map(lambda a: a[self.of[number]], values)


def sensors_of(pieces: tuple[Piece, ...]) -> Sensors:
    """List the sensors that read pieces."""
    spreads = {label: piece.sheet.spread for piece in pieces for label in piece.sensors}
    labels = tuple(spreads)
    rows = jnp.asarray(list(spreads.values()))
    place = {label: i for i, label in enumerate(labels)}
    of = tuple(np.array([place[label] for label in piece.sensors]) for piece in pieces)
    return Sensors(labels, Spreads(rows[:, :1], rows[:, 1:]), of)


class Start(NamedTuple):
    """Where the way to the most probable gains and zeros begins.

    - `at`: gains and zeros by least squares, (sensors, walkers) each.
    - `near` (walkers,): whether readings are near enough to the data for a likelihood.
    - `sigma` (sensors, walkers): noise.
    """

    at: noise.Calibration
    near: Array
    sigma: Array


def _least_squares(sensors: Sensors, turns: list[Turns], values: Mapping[str, Array]) -> Start:
    """Return every sensor's most probable gain and zero under Gaussian noise."""

    def sums(one: Turn) -> tuple[noise.Sums, Array]:
        variance = one.sigma**2 + one.step**2 / 12.0
        found = noise.Sums(*(x / variance for x in one.summed(noise.moments)))
        read = jnp.sum(one.weight * one.data**2, axis=0)[:, None] / variance
        return found, jnp.all(found.mm <= FAR**2 * (read + found.one), axis=0)

    each = {i: x for some in turns for i, x in zip(some.members, some.map(sums), strict=True)}
    total = sensors.summed({i: x for i, (x, _) in each.items()})
    near = reduce(jnp.logical_and, (near for _, near in each.values()))
    sigma = jnp.stack([values[f"noise[{label}]"] for label in sensors.labels])
    return Start(noise.least_squares(total, sensors.spread), near, sigma)


Expansions = dict[int, noise.Quadratic]
"""By piece: its log-likelihood around gains and zeros, (tracks, walkers) each."""


def _around(nodes: int, one: Turn, at: noise.Calibration) -> noise.Quadratic:
    """Expand the log-likelihood of a piece around gains and zeros (tracks, walkers)."""
    law = noise.sample_law(one.sigma, one.step, nodes)
    return noise.Quadratic(*one.summed(partial(noise.quadratic, law, *at)))


def _expanded(sensors: Sensors, turns: Iterable[Turns], at: noise.Calibration) -> Expansions:
    """Expand the log-likelihood of pieces around gains and zeros (sensors, walkers)."""
    found: Expansions = {}
    for some in turns:
        here = _stacked(sensors.on_tracks(at, i) for i in some.members)
        each = some.map(partial(_around, some.nodes), here)
        found |= dict(zip(some.members, each, strict=True))
    return found


def _again(
    sensors: Sensors,
    turns: Iterable[Turns],
    at: noise.Calibration,
    before: Expansions,
    moved: Array,
) -> Expansions:
    """Expand anew the pieces of which a sensor has `moved` (sensors,), of others as `before`."""
    found: Expansions = {}
    for some in turns:

        def one(
            turn: Turn,
            at: noise.Calibration,
            old: noise.Quadratic,
            stale: Array,
            nodes: int = some.nodes,
        ) -> noise.Quadratic:
            return jax.lax.cond(stale, lambda: _around(nodes, turn, at), lambda: old)

        here = _stacked(sensors.on_tracks(at, i) for i in some.members)
        old = _stacked(before[i] for i in some.members)
        stale = jnp.stack([jnp.any(moved[sensors.of[i]]) for i in some.members])
        found |= dict(zip(some.members, some.map(one, here, old, stale), strict=True))
    return found


def _at_top(
    sensors: Sensors, turns: list[Turns], start: Start
) -> tuple[Expansions, noise.Calibration]:
    """Expand every piece around the most probable gains and zeros, and return these.

    Gains and zeros move with what is read; so does the determinant of their information, and with
    it the marginal likelihood. The way to the top is not differentiated: where the top moves
    follows from the expansion there.
    """

    # JAX asks for the rule of slopes after this trace has ended, so arrays must come as arguments.
    def placed(each: tuple[Turn, ...]) -> list[Turns]:
        return [some._replace(each=one) for some, one in zip(turns, each, strict=True)]

    @jax.custom_jvp
    def top(
        each: tuple[Turn, ...], start: Start, spread: Spreads
    ) -> tuple[Expansions, noise.Calibration]:
        return _climbed(sensors._replace(spread=spread), placed(each), start)

    @top.defjvp
    def slopes(given: tuple, moved: tuple) -> tuple:
        def around(each: tuple[Turn, ...], at: noise.Calibration) -> Expansions:
            return _expanded(sensors, placed(each), at)

        each, _, spread = given
        at = top(*given)[1]
        held = jax.tree.map(jnp.zeros_like, at)
        found, change = jax.jvp(around, (each, at), (moved[0], held))
        drift = noise.drift_of_top(sensors.summed(found), sensors.summed(change), at, spread)
        found, change = jax.jvp(around, (each, at), (moved[0], drift))
        return (found, at), (change, drift)

    return top(tuple(some.each for some in turns), start, sensors.spread)


class _Climb(NamedTuple):
    """Where the way to the top stands, (sensors, walkers) each.

    - `at`: the best gains and zeros so far. - `value`: log-likelihood and prior there.
    - `step`: Newton's from there. - `share`: of it to try next; 0 where a sensor is at the top.
    - `found`: expansions of rounded pieces around `at`. - `tries`: so far.
    """

    at: noise.Calibration
    value: Array
    step: noise.Step
    share: Array
    found: Expansions
    tries: Array


def _climbed(
    sensors: Sensors, turns: list[Turns], start: Start
) -> tuple[Expansions, noise.Calibration]:
    """Newton steps from the gains and zeros of least squares until what they promise is to be had.

    Least squares is the top for samples that have a density. For intervals it is not: where noise
    is small against the converter's step, a few samples next to a threshold tell gain and zero, and
    least squares ends many standard deviations away, where an expansion says nothing of the top.
    """
    rounded = [some for some in turns if some.nodes]
    plain = _expanded(sensors, (some for some in turns if not some.nodes), start.at)
    if not rounded:
        return plain, start.at

    def tried(now: _Climb) -> _Climb:
        moves = zip(now.at, now.step.by, strict=True)
        at = noise.Calibration(*(a + now.share * by for a, by in moves))
        moved = (now.tries == 0) | jnp.any(now.share > 0.0, axis=1)
        found = _again(sensors, rounded, at, now.found, moved)
        sums = sensors.summed(plain | found)
        value = noise.with_prior(sums, at, sensors.spread)
        up = (value >= now.value) | (now.tries == 0)

        def better(new: Tree, old: Tree, up: Array = up) -> Tree:
            return jax.tree.map(lambda a, b: jnp.where(up, a, b), new, old)

        step = better(noise.step(sums, at, sensors.spread), now.step)
        telling = sums.h_zero * start.sigma**2
        below = start.near & (step.promise < jnp.inf) & (step.promise**3 > 4.5 * CLOSE**2 * telling)
        return _Climb(
            better(at, now.at),
            better(value, now.value),
            step,
            jnp.where(below, jnp.where(up, 1.0, SHORTER * now.share), 0.0),
            {i: better(found[i], now.found[i], sensors.on_tracks(up, i)) for i in found},
            now.tries + 1,
        )

    def going(now: _Climb) -> Array:
        return (now.tries < MOST_TRIES) & ((now.tries == 0) | jnp.any(now.share > 0.0))

    zero = jnp.zeros_like(start.at.gain)
    still = noise.Step(noise.Calibration(zero, zero), zero, zero, zero, zero)
    like = jax.eval_shape(lambda: _expanded(sensors, rounded, start.at))
    nothing = jax.tree.map(lambda a: jnp.zeros(a.shape), like)
    begin = _Climb(start.at, zero, still, zero, nothing, jnp.asarray(0))
    ended = jax.lax.while_loop(going, tried, begin)
    return plain | ended.found, ended.at


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
    turns, sensors = in_turns(pieces, predictions, values), sensors_of(pieces)
    start = _least_squares(sensors, turns, values)
    found, at = _at_top(sensors, turns, start)
    tracks: dict[tuple[int, int], Array] = {}
    for number, piece in enumerate(pieces):
        for i, track in enumerate(piece.tracks):
            key = (piece.group, track)
            tracks[key] = tracks.get(key, 0.0) + found[number].value[i]
    law = noise.marginal(sensors.summed(found), at, sensors.spread)
    return MarginalLikelihood(
        jnp.where(start.near, law.value.sum(axis=0), -jnp.inf),
        {label: jax.tree.map(lambda a, i=i: a[i], law) for i, label in enumerate(sensors.labels)},
        tracks,
    )
