"""Kalman filter and fixed-interval smoother of one record, block by block.

The smoother is that of de Jong (1989, JASA 84) as Durbin and Koopman (2012, Time Series Analysis by
State Space Methods, ch. 4) have it: it inverts only the covariance of the three readings, so states
without noise of their own do no harm. The filter's update is Joseph's. Blocks of samples share one
compiled program; the forward run keeps the state at each block's start, the backward run filters a
block again and smooths it, so that memory does not grow with the record.

Three columns run side by side with the same gains: the record; a simulated path of load and rig
read without noise; simulated noise alone. The second less what is smoothed of it is what the load's
own movement leaves unresolved, the third is what the sensors' noise does (the simulation smoother
of Durbin and Koopman 2002, Biometrika 89, in two parts).
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.smoothing.model import Nodes

COLUMNS = 3
LOG_2PI = 1.8378770664093453


class Samples(NamedTuple):
    """One block of the record, the same for all draws; (samples, ...) each.

    - `node` (samples,), `place` (samples,): left node and place towards the next, 0 to 1.
    - `reading`, `variance` (samples, 3): what was read, as a Gaussian, in SI; `known`: 1 or 0.
    - `number` (samples,): of the sample in the record; seeds its simulated noise.
    """

    node: Array
    place: Array
    reading: Array
    variance: Array
    known: Array
    number: Array


class Filtered(NamedTuple):
    """What is known before a sample.

    - `mean` (n, 3), `covariance` (n, n); simulated `path` (n,). - `evidence`: log-probability of
      the readings so far.
    """

    mean: Array
    covariance: Array
    path: Array
    evidence: Array


class Backward(NamedTuple):
    """What later samples say: `pull` (n, 3) and `information` (n, n)."""

    pull: Array
    information: Array


class Smoothed(NamedTuple):
    """Smoothed load, displacement and kappa, (samples, steps, 3) each, SI.

    - `mean`, `variance`. - `own`, `noise`: one draw of the error that the load's own movement and
      the sensors' noise leave.
    - `moved`, `moved_variance` (samples, steps, 3): movements of load, slope and kappa, in scales.
    - `read`, `read_variance` (samples, 3): noiseless reading of each sensor, SI.
    """

    mean: Array
    variance: Array
    own: Array
    noise: Array
    moved: Array
    moved_variance: Array
    read: Array
    read_variance: Array


class _Step(NamedTuple):
    """What the backward run needs of one sample."""

    innovation: Array
    inverse: Array
    gain: Array
    mean: Array
    spread: Array
    prior: Array
    path: Array
    sensed: Array
    sensed_spread: Array


def at_sample(table: Nodes, node: Array, place: Array) -> Nodes:
    """Interpolate the table between two nodes."""
    return jax.tree.map(lambda t: t[node] + place * (t[node + 1] - t[node]), table)


def _noise(key: Array, number: Array, steps: int) -> tuple[Array, Array]:
    """Standard normal numbers of a sample: for movements (steps, 3) and readings (3,)."""
    drawn = jax.random.normal(jax.random.fold_in(key, number), (steps + 1, 3))
    return drawn[:steps], drawn[steps]


def _advance(
    state: Filtered, at: Nodes, moves: Array, drawn: Array, rows: Array
) -> tuple[Filtered, tuple[Array, Array, Array]]:
    """Go through the steps to the next sample; gives what the shown rows are on the way.

    - `moves` (3,): variance of the movements of a step. - `drawn` (steps, 3): standard normal.
    """
    forced = jnp.zeros(COLUMNS).at[0].set(1.0)
    entering = (at.entry * moves) @ at.entry.T
    means, spreads, paths = [], [], []
    for step in range(drawn.shape[0]):
        means.append(rows @ state.mean)
        spreads.append(state.covariance @ rows.T)
        paths.append(rows @ state.path)
        covariance = at.step @ state.covariance @ at.step.T + entering
        state = Filtered(
            at.step @ state.mean + at.drift[:, None] * forced,
            0.5 * (covariance + covariance.T),
            at.step @ state.path + at.entry @ (jnp.sqrt(moves) * drawn[step]),
            state.evidence,
        )
    return state, (jnp.stack(means), jnp.stack(spreads), jnp.stack(paths))


def _forward(
    state: Filtered, given: tuple[Samples, Array], table: Nodes, rows: Array, run: tuple[Array, int]
) -> tuple[Filtered, _Step]:
    """Take in one sample and go on to the next."""
    key, steps = run
    sample, moves = given
    at = at_sample(table, sample.node, sample.place)
    drawn, noise = _noise(key, sample.number, steps)
    sense = at.sense * sample.known[:, None]
    variance = jnp.where(sample.known > 0, sample.variance, 1.0)
    read = jnp.stack(
        [
            (sample.reading - at.offset) * sample.known,
            sense @ state.path,
            jnp.sqrt(variance) * noise * sample.known,
        ],
        axis=1,
    )
    innovation = read - sense @ state.mean
    spread = state.covariance @ sense.T
    total = sense @ spread + jnp.diag(variance)
    inverse = jnp.linalg.inv(total)
    gain = spread @ inverse
    left = jnp.eye(gain.shape[0]) - gain @ sense
    before = state
    state = Filtered(
        state.mean + gain @ innovation,
        left @ state.covariance @ left.T + (gain * variance) @ gain.T,
        state.path,
        state.evidence + _log_density(innovation[:, 0], inverse, sample.known),
    )
    state, (mean, shown, path) = _advance(state, at, moves, drawn, rows)
    # On the way the first step begins after the sample was taken in; told from before it.
    mean = mean.at[0].set(rows @ before.mean)
    shown = shown.at[0].set(before.covariance @ rows.T)
    prior = jnp.einsum("ri,sir->sr", rows, shown)
    sensed = at.sense @ before.mean[:, 0] + at.offset
    across = before.covariance @ at.sense.T
    kept = _Step(innovation, inverse, gain, mean, shown, prior, path, sensed, across)
    return state, kept


def _log_density(innovation: Array, inverse: Array, known: Array) -> Array:
    """Log-probability density of the known readings of a sample."""
    size = innovation @ inverse @ innovation + LOG_2PI * jnp.sum(known)
    return 0.5 * (jnp.linalg.slogdet(inverse)[1] - size)


class Run(NamedTuple):
    """One block for a batch of draws.

    - `block`: the same for all. - `moves` (draws, samples, 3): variance of the movements of load,
      slope and kappa in each step from a sample to the next, in units of scales.
    - `table`, `key`: nodes and random key, draws first.
    """

    block: Samples
    moves: Array
    table: Nodes
    key: Array


BATCHED = Run(None, 0, 0, 0)  # type: ignore[arg-type] - axes of a batch


@partial(jax.jit, static_argnames="steps")
def forward(state: Filtered, run: Run, rows: Array, steps: int) -> Filtered:
    """Filter a block for a batch of draws (first axis of state).

    - `rows` (3, n): what is shown of a state. - `steps`: to the next sample.

    Returns what is known before the next block.
    """

    def one(state: Filtered, run: Run) -> Filtered:
        def step(carry: Filtered, given: tuple[Samples, Array]) -> tuple[Filtered, None]:
            return _forward(carry, given, run.table, rows, (run.key, steps))[0], None

        return jax.lax.scan(step, state, (run.block, run.moves))[0]

    return jax.vmap(one, (0, BATCHED))(state, run)


@partial(jax.jit, static_argnames="steps")
def backward(
    later: Backward, state: Filtered, run: Run, rows: Array, steps: int
) -> tuple[Backward, Smoothed]:
    """Smooth a block for a batch of draws.

    - `later`: what the samples after the block say. - `state`: what is known before it.
    """

    def one(later: Backward, state: Filtered, run: Run) -> tuple[Backward, Smoothed]:
        def ahead(carry: Filtered, given: tuple[Samples, Array]) -> tuple[Filtered, _Step]:
            return _forward(carry, given, run.table, rows, (run.key, steps))

        _, kept = jax.lax.scan(ahead, state, (run.block, run.moves))

        def back(carry: Backward, given: tuple) -> tuple[Backward, Smoothed]:
            (sample, moves), step = given
            at = at_sample(run.table, sample.node, sample.place)
            return _back(carry, at, (sample.known, moves), step)

        return jax.lax.scan(back, later, ((run.block, run.moves), kept), reverse=True)

    return jax.vmap(one, (0, 0, BATCHED))(later, state, run)


def _back(
    later: Backward, at: Nodes, given: tuple[Array, Array], kept: _Step
) -> tuple[Backward, Smoothed]:
    """Go back over the steps after a sample and over the sample."""
    known, moves = given
    count = kept.mean.shape[0]
    means, variances = [kept.path] * count, [kept.path] * count
    moved, moved_variance = [moves] * count, [moves] * count
    for step in reversed(range(count)):
        moved[step] = moves * (at.entry.T @ later.pull[:, 0])
        seen = jnp.einsum("ij,ik,kj->j", at.entry, later.information, at.entry)
        moved_variance[step] = moves * (1.0 - moves * seen)
        later = Backward(at.step.T @ later.pull, at.step.T @ later.information @ at.step)
        if step == 0:
            sense = at.sense * known[:, None]
            left = jnp.eye(at.step.shape[0]) - kept.gain @ sense
            weighed = sense.T @ kept.inverse
            later = Backward(
                weighed @ kept.innovation + left.T @ later.pull,
                weighed @ sense + left.T @ later.information @ left,
            )
        spread = kept.spread[step]
        means[step] = kept.mean[step] + spread.T @ later.pull
        lost = jnp.einsum("ij,ik,kj->j", spread, later.information, spread)
        variances[step] = kept.prior[step] - lost
    read = kept.sensed + kept.sensed_spread.T @ later.pull[:, 0]
    lost = jnp.einsum("ij,ik,kj->j", kept.sensed_spread, later.information, kept.sensed_spread)
    prior = jnp.einsum("ij,ji->i", at.sense, kept.sensed_spread)
    found = jnp.stack(means)
    out = Smoothed(
        mean=found[:, :, 0],
        variance=jnp.stack(variances),
        own=kept.path - found[:, :, 1],
        noise=-found[:, :, 2],
        moved=jnp.stack(moved),
        moved_variance=jnp.stack(moved_variance),
        read=read,
        read_variance=prior - lost,
    )
    return later, out
