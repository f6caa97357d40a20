"""Kalman filter and fixed-interval smoother of one record, block by block.

The smoother is that of de Jong (1989, JASA 84) as Durbin and Koopman (2012, Time Series Analysis by
State Space Methods, ch. 4) have it: it does not invert the covariance of the state, so states
without noise of their own do no harm. The readings of a sample are taken in one after another
(section 6.4 there), so that nothing but a variance is divided by. Blocks of samples share one
compiled program; the forward run keeps the state at each block's start, the backward run filters a
block again and smooths it, so that memory does not grow with the record.

Where errors are simulated three columns run side by side with the same gains: the record; a
simulated path of load and rig read without noise; simulated noise alone. The second less what is
smoothed of it is what the load's own movement leaves unresolved, the third is what the sensors'
noise does (the simulation smoother of Durbin and Koopman 2002, Biometrika 89, in two parts).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.smoothing.interval import Interval, along

COLUMNS = 3
"""Columns of a mean where errors are simulated; otherwise the record's is the only one."""

LOG_2PI = 1.8378770664093453


class Samples(NamedTuple):
    """One block of the record, the same for all draws; (samples, ...) each.

    - `place` (samples,): on the way from the node before it to the next, 0 to 1; as many samples
      from each node on.
    - `reading`, `variance` (samples, channels): what was read, as a Gaussian, in SI; `known`: 1 or
      0.
    - `number` (samples,): of the sample in the record; seeds its simulated noise.
    """

    place: Array
    reading: Array
    variance: Array
    known: Array
    number: Array


class Filtered(NamedTuple):
    """What is known before a sample.

    - `mean` (n, columns), `covariance` (n, n); simulated `path` (n,). - `evidence`: log-probability
      of the readings so far.
    """

    mean: Array
    covariance: Array
    path: Array
    evidence: Array


class Backward(NamedTuple):
    """What later samples say: `adjoint` (n, columns) and `information` (n, n)."""

    adjoint: Array
    information: Array


class Shown(NamedTuple):
    """Smoothed loads, displacements and flow fractions, (samples, steps, shown) each, SI.

    - `mean`, `variance`. - `own`, `noise`: one draw of the error that the load's own movement and
      the sensors' noise leave.
    """

    mean: Array
    variance: Array
    own: Array
    noise: Array


class Smoothed(NamedTuple):
    """What a block is found to be.

    - `moved`, `moved_variance` (samples, steps, inputs): movements of loads, slopes and flow
      fractions, in scales.
    - `read`, `read_variance` (samples, channels): noiseless reading of each sensor, SI.
    - `shown`: None where no errors were simulated, as in learning.
    """

    moved: Array
    moved_variance: Array
    read: Array
    read_variance: Array
    shown: Shown | None


class BlockRun(NamedTuple):
    """One block for a batch of draws.

    - `block`: the same for all. - `moves` (draws, samples, inputs): variance of the movements of
      loads, slopes and flow fractions in each step from a sample to the next, in units of scales.
    - `table`: intervals at nodes, draws first. - `key`: random key, draws first, or None where no
      errors are simulated.
    """

    block: Samples
    moves: Array
    table: Interval
    key: Array | None


BATCHED = BlockRun(None, 0, 0, 0)  # type: ignore[arg-type] - axes of a batch


class _Drawn(NamedTuple):
    """Standard normal numbers: `moves` (..., steps inputs), `noise` (..., channels)."""

    moves: Array
    noise: Array


class _Taken(NamedTuple):
    """One reading as it was taken in: `gain` (n,), `adjoint` (columns,), `weight` ()."""

    gain: Array
    adjoint: Array
    weight: Array


class _Within(NamedTuple):
    """What is shown within an interval before later samples are looked at.

    - `mean` (steps shown, columns); `spread` (n, steps shown): with the state at the interval's
      end; `prior`, simulated `path` (steps shown,).
    """

    mean: Array
    spread: Array
    prior: Array
    path: Array


class _Step(NamedTuple):
    """What the backward run needs of one sample.

    - `taken`: its readings. - `sensed`, `prior` (channels,): expected readings and their variance.
    - `spread` (n, channels): of these with the state.
    """

    taken: tuple[_Taken, ...]
    sensed: Array
    prior: Array
    spread: Array
    within: _Within | None


def _drawn(run: BlockRun) -> _Drawn | None:
    """Random numbers of a block, those of a sample by its number in the record."""
    if run.key is None:
        return None
    key, wide = run.key, run.table.entry.shape[-1]
    channels = run.table.sense.shape[-2]

    def one(number: Array) -> Array:
        return jax.random.normal(jax.random.fold_in(key, number), (wide + channels,))

    drawn = jax.vmap(one)(run.block.number)
    return _Drawn(drawn[:, :wide], drawn[:, wide:])


def _read(
    state: Filtered, at: Interval, sample: Samples, noise: Array | None
) -> tuple[Filtered, tuple[_Taken, ...]]:
    """Take in the readings of a sample, one after another."""
    mean, covariance, evidence = state.mean, state.covariance, state.evidence
    taken = []
    for i in range(at.sense.shape[0]):
        known = sample.known[i]
        sense = at.sense[i] * known
        variance = jnp.where(known > 0, sample.variance[i], 1.0)
        read = [(sample.reading[i] - at.offset[i]) * known]
        if noise is not None:
            read += [sense @ state.path, jnp.sqrt(variance) * noise[i] * known]
        spread = covariance @ sense
        weight = 1.0 / (sense @ spread + variance)
        gain = spread * weight
        off = jnp.stack(read) - sense @ mean
        mean = mean + gain[:, None] * off
        covariance = covariance - gain[:, None] * spread
        evidence += 0.5 * known * (jnp.log(weight) - LOG_2PI - weight * off[0] ** 2)
        taken.append(_Taken(gain, weight * off, weight))
    return Filtered(mean, covariance, state.path, evidence), tuple(taken)


def _forward(
    state: Filtered, given: tuple[Samples, Array, _Drawn | None], at: Interval
) -> tuple[Filtered, _Step]:
    """Take in one sample and go on to the next."""
    sample, moves, drawn = given
    sensed = at.sense @ state.mean[:, 0] + at.offset
    across = state.covariance @ at.sense.T
    prior = jnp.sum(at.sense.T * across, axis=0)
    state, taken = _read(state, at, sample, None if drawn is None else drawn.noise)
    wide = jnp.tile(moves, at.entry.shape[1] // len(moves))
    forced = jnp.zeros(state.mean.shape[1]).at[0].set(1.0)
    half, entering = at.step @ state.covariance, at.entry * wide
    covariance = half @ at.step.T + entering @ at.entry.T
    path, within = state.path, None
    if drawn is not None:
        steps = jnp.sqrt(wide) * drawn.moves
        across_rows = state.covariance @ at.rows.T
        within = _Within(
            mean=at.rows @ state.mean + at.rest[:, None] * forced,
            spread=at.step @ across_rows + entering @ at.within.T,
            prior=jnp.sum(at.rows.T * across_rows, axis=0) + at.within**2 @ wide,
            path=at.rows @ path + at.within @ steps,
        )
        path = at.step @ path + at.entry @ steps
    later = Filtered(
        at.step @ state.mean + at.drift[:, None] * forced,
        0.5 * (covariance + covariance.T),
        path,
        state.evidence,
    )
    return later, _Step(taken, sensed, prior, across, within)


@jax.jit
def forward(state: Filtered, run: BlockRun) -> Filtered:
    """Filter a block for a batch of draws (first axis of state).

    Returns what is known before the next block.
    """

    def step(carry: Filtered, given: tuple, at: Interval) -> tuple[Filtered, None]:
        return _forward(carry, given, at)[0], None

    def one(state: Filtered, run: BlockRun) -> Filtered:
        given = run.block, run.moves, _drawn(run)
        return along(step, state, run.table, (run.block.place, given))[0]

    return jax.vmap(one, (0, BATCHED))(state, run)


@jax.jit
def backward(later: Backward, state: Filtered, run: BlockRun) -> tuple[Backward, Smoothed]:
    """Smooth a block for a batch of draws.

    - `later`: what the samples after the block say. - `state`: what is known before it.
    """

    def one(later: Backward, state: Filtered, run: BlockRun) -> tuple[Backward, Smoothed]:
        place, given = run.block.place, (run.block, run.moves, _drawn(run))
        _, kept = along(_forward, state, run.table, (place, given))
        given = run.block, run.moves, kept
        return along(_back, later, run.table, (place, given), reverse=True)

    return jax.vmap(one, (0, 0, BATCHED))(later, state, run)


def _back(
    later: Backward, given: tuple[Samples, Array, _Step], at: Interval
) -> tuple[Backward, Smoothed]:
    """Go back over an interval and over the sample at its beginning."""
    sample, moves, kept = given
    adjoint, information = later
    wide = jnp.tile(moves, at.entry.shape[1] // len(moves))
    moved = wide * (at.entry.T @ adjoint[:, 0])
    seen = jnp.sum(at.entry * (information @ at.entry), axis=0)
    steps = at.entry.shape[1] // len(moves)
    shown = None if kept.within is None else _shown(later, kept.within, steps)
    adjoint, information = at.step.T @ adjoint, at.step.T @ information @ at.step
    for i in reversed(range(at.sense.shape[0])):
        sense, (gain, off, weight) = at.sense[i] * sample.known[i], kept.taken[i]
        across = information @ gain
        adjoint = adjoint + sense[:, None] * (off - gain @ adjoint)
        mixed = sense[:, None] * (0.5 * (weight + gain @ across) * sense - across)
        information = information + mixed + mixed.T
    return Backward(adjoint, information), Smoothed(
        moved=moved.reshape(-1, len(moves)),
        moved_variance=(wide * (1.0 - wide * seen)).reshape(-1, len(moves)),
        read=kept.sensed + kept.spread.T @ adjoint[:, 0],
        read_variance=kept.prior - jnp.sum(kept.spread * (information @ kept.spread), axis=0),
        shown=shown,
    )


def _shown(later: Backward, within: _Within, steps: int) -> Shown:
    """Smooth what is shown within an interval of `steps`."""
    found = within.mean + within.spread.T @ later.adjoint
    lost = jnp.sum(within.spread * (later.information @ within.spread), axis=0)
    # Of what is told to a part in a million of what it might be, rounding leaves less than nothing.
    variance = jnp.maximum(within.prior - lost, 0.0)
    told = (found[:, 0], variance, within.path - found[:, 1], -found[:, 2])
    return Shown(*(part.reshape(steps, -1) for part in told))
