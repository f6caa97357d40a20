"""Scales of the movements of loads and valves, learned at the posterior's centre."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np

from rigid.smoothing import latent, quantised
from rigid.smoothing.aside import Expected, contradicted, doubtful
from rigid.smoothing.field import BLOCK, Field, liveliest
from rigid.smoothing.inputs import Inputs, per_input
from rigid.smoothing.kalman import Filtered
from rigid.smoothing.latent import Movement
from rigid.smoothing.smoother import (
    STEPS,
    DrawBatch,
    Evidence,
    filtered,
    last_state,
    smooth,
    smoothed,
)

FACTORS = (8.0, 3.0, 1.7)
"""By which each scale is tried up and down, round by round; a round that moves goes on."""

ROUNDS = 10
PASSES = 2
"""Passes of variational Bayes for each round of candidates."""

LAST_PASSES = 6
FIRST_PASSES = 3
"""More passes where the intervals begin calm."""

SEARCHED = 16
"""Blocks, 82 s at 100 Hz, over which scales are compared: of a longer record the stretch in which
the load's readings change most often. There, thousands of intervals tell three numbers."""


class Learned(NamedTuple):
    """What the record says before draws are told apart.

    - `movement`: law and intervals. - `reading`, `variance` (samples, channels): readings as
      Gaussians. - `bound`: of the log-evidence. - `mean` (samples, steps, told): as `Inputs.told`.
    - `gap` (channels,): root mean square of the readings' residuals over noise and rounding.
    - `aside` (samples, channels): readings that were set aside.
    """

    movement: Movement
    reading: np.ndarray
    variance: np.ndarray
    bound: float
    mean: np.ndarray
    gap: np.ndarray
    aside: np.ndarray

    @property
    def evidence(self) -> Evidence:
        """What the smoother needs of it."""
        return Evidence(self.reading, self.variance, self.movement.variances)


class Pass(NamedTuple):
    """One pass over the record: next movement, bound of the last, and readings without noise.

    - `read_variance` (samples, channels): of the first candidate's.
    """

    movement: Movement
    bound: np.ndarray
    read: np.ndarray
    read_variance: np.ndarray


class Sheet(NamedTuple):
    """`sigma`, `step` (channels,) of the sensors [SI]."""

    sigma: np.ndarray
    step: np.ndarray


def learn(
    field: Field, centre: DrawBatch, sheet: Sheet, report: Callable[[int], None] = lambda _: None
) -> Learned:
    """Find the scales of greatest evidence and every interval's variance.

    Readings that stand off their neighbours are left out at first. Those that all others explain
    are taken back; the rest are set aside.

    - `centre`: one draw. - `report`: is told each pass.
    """
    sd = np.sqrt(np.square(sheet.sigma) + np.square(sheet.step) / 12.0)
    aside = doubtful(field, sd)
    found, expected = _learned(field.without(aside), centre, sheet, report)
    taken_back = aside & ~contradicted(field, expected, sd)
    if taken_back.any():
        aside &= ~taken_back
        found, _ = _learned(field.without(aside), centre, sheet, report)
    return found._replace(aside=aside)


def _learned(
    field: Field, centre: DrawBatch, sheet: Sheet, report: Callable[[int], None]
) -> tuple[Learned, Expected]:
    """Find scales and variances of a record as it is, and what its readings then are expected."""
    part, start = _liveliest(field, centre, sheet)
    reading, variance = part.reading, quantised.plain(part.reading, *sheet)
    inputs = field.setup.inputs
    scale = np.tile(_begun(part), (_candidates(inputs), 1))
    movement = latent.calm(part.samples, STEPS, scale)
    best, at = movement, 0
    for number in range(ROUNDS):
        trial = movement if number == 0 else _around(best, FACTORS[at], inputs)
        for _ in range(PASSES + FIRST_PASSES * (number == 0)):
            done = one_pass(part, centre, (reading, variance), trial, start)
            trial = done.movement
            report(1)
        won = int(np.argmax(done.bound))
        reading, variance = quantised.expanded(part.reading, done.read[won], *sheet)
        best = _only(trial, won)
        if won == 0 and number > 0:
            at += 1
            if at == len(FACTORS):
                break
    if part is field:
        return _final(field, centre, sheet, ((reading, variance), best, LAST_PASSES), report)
    read = field.reading, quantised.plain(field.reading, *sheet)
    calm = latent.calm(field.samples, STEPS, best.scale)
    begun = read, calm, LAST_PASSES + FIRST_PASSES
    return _final(field, centre, sheet, begun, report)


def _liveliest(field: Field, centre: DrawBatch, sheet: Sheet) -> tuple[Field, Filtered | None]:
    """The stretch over which scales are compared, and what is known before it.

    What is known before it is filtered with the scales from which learning begins; it is forgotten
    within seconds.
    """
    if field.blocks <= SEARCHED:
        return field, None
    here = liveliest(field, SEARCHED)
    part = field.cut(here.start, here.stop)
    if here.start == 0:
        return part, None
    before = field.cut(0, here.start)
    calm = latent.calm(before.samples, STEPS, _begun(before))
    plain = quantised.plain(before.reading, *sheet)
    state = last_state(before, centre, Evidence(before.reading, plain, calm.variances))
    return part, state


def _begun(field: Field) -> np.ndarray:
    """Scales from which learning begins (inputs,); of what was recorded those that it shows.

    Between two samples a recorded input is a straight line, as far as its slope may change.
    """
    setup = field.setup
    scale = per_input(setup.inputs, *latent.START)
    least = per_input(setup.inputs, *latent.LEAST)
    for which, channel in enumerate(setup.recorded):
        at = len(setup.inputs.loads) + which
        turned = np.diff(field.reading[:, channel], 2) / field.interval
        slope = at + setup.inputs.straight
        scale[at] = least[at]
        scale[slope] = np.sqrt(np.mean(turned**2)) / setup.inputs.scales[slope]
    return np.maximum(scale, least)


def _candidates(inputs: Inputs) -> int:
    """How many laws are compared in a round."""
    return 1 + 2 * sum(inputs.sought) + len(inputs.loads)


def _around(best: Movement, factor: float, inputs: Inputs) -> Movement:
    """The best and its neighbours: each scale up and down by a factor, load and slope both down.

    Scales of what was recorded stay: its readings tell all that there is.
    """
    count = _candidates(inputs)
    wide, change = _repeated(best, count), np.ones((count, inputs.count))
    at = 1
    for i in np.flatnonzero(inputs.sought):
        change[at, i], change[at + 1, i] = factor, 1.0 / factor
        at += 2
    for load in range(len(inputs.loads)):
        change[at, [load, inputs.straight + load]] = 1.0 / factor
        at += 1
    return wide.rescaled(np.maximum(wide.scale * change, per_input(inputs, *latent.LEAST)))


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
    field: Field,
    draws: DrawBatch,
    read: tuple[np.ndarray, np.ndarray],
    movement: Movement,
    start: Filtered | None = None,
) -> Pass:
    """Smooth once for every candidate and take in what moved, block by block."""
    evidence = Evidence(*read, movement.variances)
    begins = filtered(field, draws, evidence, None, start)
    ways = len(np.atleast_1d(begins[-1].evidence))
    count, channels = field.setup.inputs.count, len(field.setup.channels)
    rate, seen = (np.zeros((ways, field.samples, count)) for _ in range(2))
    sensed, variance = np.zeros((ways, field.samples, channels)), np.zeros(field.reading.shape)
    for first, block, _ in smoothed(field, draws, evidence, None, begins):
        here = slice(first, min(first + BLOCK, field.samples))
        size = here.stop - first
        moved, spread = np.asarray(block.moved), np.asarray(block.moved_variance)
        taken = latent.updated(movement, moved[:, :size], spread[:, :size])
        rate[:, here], seen[:, here] = taken.rate, taken.seen
        sensed[:, here] = np.asarray(block.read)[:, :size]
        variance[here] = np.asarray(block.read_variance)[0, :size]
    value = latent.bound(movement, np.asarray(begins[-1].evidence))
    return Pass(movement._replace(rate=rate, seen=seen), value, sensed, variance)


def _final(
    field: Field,
    centre: DrawBatch,
    sheet: Sheet,
    begun: tuple[tuple[np.ndarray, np.ndarray], Movement, int],
    report: Callable[[int], None],
) -> tuple[Learned, Expected]:
    """Go on with the scales that were found until the intervals have settled.

    - `begun`: readings as Gaussians, the movement so far, and how many passes to make.
    """
    read, best, passes = begun
    movement = _repeated(best, 1)
    for _ in range(passes):
        used, done = movement, one_pass(field, centre, read, movement)
        movement = done.movement
        read = quantised.expanded(field.reading, done.read[0], *sheet)
        report(1)
    off = (field.reading - done.read[0]) ** 2 / quantised.plain(field.reading, *sheet)
    gap = np.sqrt(np.sum(off * field.known, axis=0) / np.maximum(field.known.sum(axis=0), 1.0))
    mean = _told(field, centre, Evidence(*read, used.variances))
    none = np.zeros(field.known.shape, dtype=bool)
    expected = Expected(done.read[0], done.read_variance)
    return Learned(_only(used, 0), *read, float(done.bound[0]), mean, gap, none), expected


def _told(field: Field, centre: DrawBatch, evidence: Evidence) -> np.ndarray:
    """Mean of what is told of one draw, (samples, steps, told)."""
    mean = np.zeros((field.blocks * BLOCK, STEPS, len(field.setup.inputs.told)))
    keys = jax.random.split(jax.random.key(0), 1)
    for first, block in smooth(field, centre, evidence, keys):
        assert block.shown is not None  # there are keys
        mean[first : first + BLOCK] = block.shown.mean[0]
    return mean[: field.samples]
