"""Scales of the load's movements learned from a record, at the posterior's centre."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np

from rigid.smoothing import latent, quantised
from rigid.smoothing.field import BLOCK, Field
from rigid.smoothing.latent import Movement
from rigid.smoothing.smoother import STEPS, Draws, Evidence, filtered, smooth, smoothed

FACTORS = (8.0, 3.0, 1.7)
"""By which each scale is tried up and down, round by round; a round that moves goes on."""

ROUNDS = 10
PASSES = 2
"""Passes of variational Bayes for each round of candidates."""

LAST_PASSES = 6
CANDIDATES = 8


class Learned(NamedTuple):
    """What the record says before draws are told apart.

    - `movement`: law and intervals. - `reading`, `variance` (samples, 3): readings as Gaussians.
    - `bound`: of the log-evidence. - `mean`, `sd` (samples, steps, 3): load, displacement, kappa.
    - `gap` (3,): root mean square of the readings' residuals over noise and rounding.
    """

    movement: Movement
    reading: np.ndarray
    variance: np.ndarray
    bound: float
    mean: np.ndarray
    sd: np.ndarray
    gap: np.ndarray

    @property
    def evidence(self) -> Evidence:
        """What the smoother needs of it."""
        return Evidence(self.reading, self.variance, self.movement.variances)


class Pass(NamedTuple):
    """One pass over the record: next movement, bound of the last, and readings without noise."""

    movement: Movement
    bound: np.ndarray
    read: np.ndarray


class Sheet(NamedTuple):
    """`sigma`, `step` (3,) of the load, stroke and pressure sensors [SI]."""

    sigma: np.ndarray
    step: np.ndarray


def learn(
    field: Field, centre: Draws, sheet: Sheet, report: Callable[[int], None] = lambda _: None
) -> Learned:
    """Find the scales of greatest evidence and every interval's variance.

    - `centre`: one draw. - `report`: is told each pass.
    """
    reading, variance = field.reading, quantised.plain(field.reading, *sheet)
    scale = np.tile(np.array(latent.START), (CANDIDATES, 1))
    movement = latent.calm(field.samples, STEPS, scale)
    best, at = movement, 0
    for number in range(ROUNDS):
        trial = movement if number == 0 else _around(best, FACTORS[at])
        for _ in range(PASSES + 3 * (number == 0)):
            done = one_pass(field, centre, (reading, variance), trial)
            trial = done.movement
            report(1)
        won = int(np.argmax(done.bound))
        reading, variance = quantised.expanded(field.reading, done.read[won], *sheet)
        best = _only(trial, won)
        if won == 0 and number > 0:
            at += 1
            if at == len(FACTORS):
                break
    return _final(field, centre, sheet, (reading, variance), best)


def _around(best: Movement, factor: float) -> Movement:
    """The best and its neighbours: each scale up and down by a factor, load and slope both down."""
    wide = _repeated(best, CANDIDATES)
    change = np.ones((CANDIDATES, 3))
    for i in range(3):
        change[1 + 2 * i, i], change[2 + 2 * i, i] = factor, 1.0 / factor
    change[7, :2] = 1.0 / factor
    return wide.rescaled(np.maximum(wide.scale * change, latent.LEAST))


def _only(movement: Movement, number: int) -> Movement:
    return movement._replace(
        scale=movement.scale[number], rate=movement.rate[number], seen=movement.seen[number]
    )


def _repeated(movement: Movement, count: int) -> Movement:
    return movement._replace(
        scale=np.repeat(movement.scale[None], count, 0),
        rate=np.repeat(movement.rate[None], count, 0),
        seen=np.repeat(movement.seen[None], count, 0),
    )


def one_pass(
    field: Field, draws: Draws, read: tuple[np.ndarray, np.ndarray], movement: Movement
) -> Pass:
    """Smooth once for every candidate and take in what moved."""
    evidence = Evidence(*read, movement.variances)
    begins = filtered(field, draws, evidence, None)
    found: list[tuple[np.ndarray, ...]] = []
    for _, block in smoothed(field, draws, evidence, None, begins):
        found.append(tuple(map(np.asarray, (block.moved, block.moved_variance, block.read))))
    moved, moved_variance, sensed = (
        np.concatenate(part[::-1], axis=1)[:, : field.samples] for part in zip(*found, strict=True)
    )
    value = latent.bound(movement, np.asarray(begins[-1].evidence))
    return Pass(latent.updated(movement, moved, moved_variance), value, sensed)


def _final(
    field: Field,
    centre: Draws,
    sheet: Sheet,
    read: tuple[np.ndarray, np.ndarray],
    best: Movement,
) -> Learned:
    """Go on with the scales that were found until the intervals have settled."""
    movement = _repeated(best, 1)
    for _ in range(LAST_PASSES):
        used, done = movement, one_pass(field, centre, read, movement)
        movement = done.movement
        read = quantised.expanded(field.reading, done.read[0], *sheet)
    off = (field.reading - done.read[0]) ** 2 / quantised.plain(field.reading, *sheet)
    gap = np.sqrt(np.sum(off * field.known, axis=0) / np.maximum(field.known.sum(axis=0), 1.0))
    mean, variance = _told(field, centre, Evidence(*read, used.variances))
    return Learned(_only(used, 0), *read, float(done.bound[0]), mean, np.sqrt(variance), gap)


def _told(field: Field, centre: Draws, evidence: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of what is shown of one draw, (samples, steps, 3)."""
    mean, variance = (np.zeros((field.blocks * BLOCK, STEPS, 3)) for _ in range(2))
    keys = jax.random.split(jax.random.key(0), 1)
    for first, block in smooth(field, centre, evidence, keys):
        assert block.shown is not None  # there are keys
        mean[first : first + BLOCK] = block.shown.mean[0]
        variance[first : first + BLOCK] = block.shown.variance[0]
    return mean[: field.samples], variance[: field.samples]
