"""Samples that are no facts: single ones far off their neighbours, and those beyond a range.

One rule for fit, laws and discovery; `rigid.smoothing.aside` has that of bands. Single samples that
stand far off both neighbours are no physics of a rig (a bit that flipped, a sample in the middle of
a release), nor is what a sensor reads at the end of its range. Both are looked for in what a fit
leaves over, and do not count.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from rigid.likelihood.problem import Problem
from rigid.records.checks import SATURATED_RUN
from rigid.records.defects import runs

SPIKE = 6.0
"""Sds of noise and rounding that a sample must stand off the median of its neighbourhood."""
NEIGHBOURS = 5
MANY = 0.05
"""Share of a channel's samples from which those that stand off are no single ones: a model that
lacks something lets all that swings within a few samples stand off."""
ABOVE = 2.0
"""Sds by which the fit must lie above each of SATURATED_RUN equal greatest readings in a row."""
STANDS = 0.9
"""Share of the readings, from the first greatest one on to the last while the fit lies that far
above them, that must be the greatest: where the rig holds still, noise goes on in the converter."""


@dataclasses.dataclass(frozen=True)
class Readings:
    """Samples of channels one after another, as far as the rule asks.

    - `data` (n,): what was read, SI. - `read` (n,): whether anything was. - `sd` (n,): of noise and
      rounding; `step` (n,): of the converter. - `channel`, `sensor` (n,): numbers.
    """

    data: Float[np.ndarray, " n"]
    read: Bool[np.ndarray, " n"]
    sd: Float[np.ndarray, " n"]
    step: Float[np.ndarray, " n"]
    channel: Int[np.ndarray, " n"]
    sensor: Int[np.ndarray, " n"]


class Aside(NamedTuple):
    """Samples of one channel that were set aside: record, cylinder, quantity, instants [s]."""

    record: str
    cylinder: str
    quantity: str
    times: tuple[float, ...]

    def values(self) -> Mapping[str, Any]:
        """An entry of `set_aside` in the results."""
        where = {"record": self.record, "cylinder": self.cylinder, "channel": self.quantity}
        return where | {"samples": len(self.times), "time_s": [round(t, 9) for t in self.times]}


def readings_of(problem: Problem, sigma: Float[np.ndarray, " sensors"]) -> Readings:
    """The samples of a problem, piece after piece and in each channel after channel.

    - `sigma`: noise of every sensor, in the order of `problem.sensors`.
    """
    columns, sensors, count = [], problem.sensors, 0
    for piece in problem.pieces:
        for i in range(len(piece.tracks)):
            rows, step = piece.data.shape[0], piece.sheet.step
            sensor = sensors.index(piece.sensor(i))
            sd = float(np.sqrt(sigma[sensor] ** 2 + step**2 / 12.0))
            constant = (np.full(rows, value) for value in (sd, step, count, sensor))
            data, read = np.asarray(piece.data)[:, i], np.asarray(piece.weight)[:, i] > 0.0
            columns.append((data, read, *constant))
            count += 1
    return Readings(*(np.concatenate(column) for column in zip(*columns, strict=True)))


def by_piece(problem: Problem, samples: Bool[np.ndarray, " n"]) -> list[Bool[np.ndarray, "rows t"]]:
    """Samples in the order of `readings_of`, as (samples, tracks) of every piece."""
    ends = np.cumsum([piece.data.size for piece in problem.pieces])[:-1]
    parts = zip(problem.pieces, np.split(samples, ends), strict=True)
    return [part.reshape(len(piece.tracks), -1).T for piece, part in parts]


def listed(problem: Problem, aside: Bool[np.ndarray, " n"]) -> tuple[Aside, ...]:
    """What was set aside, by channel; channels of which nothing was are left out."""
    found = []
    for piece, mask in zip(problem.pieces, by_piece(problem, aside), strict=True):
        for i in np.flatnonzero(mask.any(axis=0)):
            track = problem.groups[piece.group].tracks[piece.tracks[i]]
            times = float(track.first) + track.interval * np.flatnonzero(mask[:, i])
            found.append(Aside(track.name, track.cylinder, piece.quantity, tuple(times.tolist())))
    return tuple(found)


def without(problem: Problem, aside: Bool[np.ndarray, " n"]) -> Problem:
    """Return the same problem in which samples do not count."""
    masks = zip(problem.pieces, by_piece(problem, aside), strict=True)
    return problem.with_weights(
        {(p.group, p.quantity): np.where(mask, 0.0, np.asarray(p.weight)) for p, mask in masks}
    )


def set_aside(readings: Readings, residual: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Which samples do not count.

    - `residual`: recorded less expected.
    """
    return spikes(readings, residual) | beyond(readings, residual)


def spikes(readings: Readings, residual: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Where a sample stands off its neighbours.

    Spikes are in the noise level that they are compared with; so they are looked for again with
    the level of what is left, until none are found. Where more than MANY of a channel stand off,
    none of them is one.
    """
    sensor, read = readings.sensor, readings.read
    off, found = off_neighbours(readings, residual), np.zeros(len(residual), dtype=bool)
    while True:
        level = np.ones(sensor.max(initial=0) + 1)
        for number in range(len(level)):
            mine = read & (sensor == number)
            if (mine & found).any():
                left = residual[mine & ~found]
                level[number] = np.sqrt(np.mean(left**2) / np.mean(residual[mine] ** 2))
        again = off > SPIKE * level[sensor] * readings.sd
        if not np.any(again & ~found):
            return found & ~_many(readings, found)
        found |= again


def _many(readings: Readings, found: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Samples of channels of which more than MANY were found."""
    read, count = readings.read, int(readings.channel.max(initial=-1)) + 1
    each = np.bincount(readings.channel[read], minlength=count)
    off = np.bincount(readings.channel[read & found], minlength=count)
    return (off > MANY * each)[readings.channel]


def off_neighbours(
    readings: Readings, residual: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """How far each sample lies off the median of its neighbourhood."""
    half, off = NEIGHBOURS // 2, np.zeros(len(residual))
    for number in range(readings.channel.max(initial=-1) + 1):
        rows = np.flatnonzero((readings.channel == number) & readings.read)
        if len(rows) < NEIGHBOURS:
            continue
        series = np.pad(residual[rows], half, mode="edge")
        near = np.lib.stride_tricks.sliding_window_view(series, NEIGHBOURS)
        off[rows] = np.abs(residual[rows] - np.median(near, axis=1))
    return off


def beyond(readings: Readings, residual: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Where the fit lies beyond the end of a sensor's range.

    A sensor that stands still at its greatest reading, while the fit is above it throughout, has
    come to an end there. What it reads where the fit is that high says nothing, whichever way its
    noise fell. A rig that holds lower than a model has it, which lacks something, reads the steps
    below as well.
    """
    data, found = readings.data, np.zeros(len(residual), dtype=bool)
    for sensor in range(readings.sensor.max(initial=-1) + 1):
        mine = (readings.sensor == sensor) & readings.read
        if not mine.any():
            continue
        end = float(data[mine].max()) - 0.5 * readings.step[mine].max()
        stuck = mine & (data >= end) & (residual < -ABOVE * readings.sd)
        for number in np.unique(readings.channel[stuck]):
            rows = np.flatnonzero((readings.channel == number) & readings.read)
            firsts, lasts = runs(stuck[rows])
            above = data[rows] - residual[rows] > end + ABOVE * readings.sd[rows]
            if np.any(lasts - firsts + 1 >= SATURATED_RUN) and _stands(above, stuck[rows]):
                found |= mine & (data - residual > end)
    return found


def _stands(above: Bool[np.ndarray, " n"], stuck: Bool[np.ndarray, " n"]) -> bool:
    """Whether readings stand still where the fit lies above the greatest one.

    - `above`: where it does. - `stuck`: where, besides, the reading is the greatest.
    """
    spans = 0
    for first, last in zip(*runs(above), strict=True):
        there = np.flatnonzero(stuck[first : last + 1])
        spans += int(there[-1] - there[0]) + 1 if there.size else 0
    return int(stuck.sum()) >= STANDS * spans
