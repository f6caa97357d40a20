"""Readings of a field record that are no facts: single ones that all others contradict.

As in fits (`rigid.likelihood.set_aside`), a reading is doubted that stands six sds off the median
of its neighbourhood. But here the load is unknown and may fall at any moment, and a smoother
follows whatever is read. So a reading is doubted only if it stands off alone: no other sensor does
at that sample, as in a fall of the load that pressure and stroke tell of, nor does the same sensor
next to it, as a load cell that rings after a fall. It is set aside only if, with all doubted ones
left out, the rest of the record says that it cannot have been.
"""

from typing import NamedTuple

import numpy as np

from rigid.likelihood.set_aside import SPIKE, Aside, Readings, off_neighbours
from rigid.smoothing.field import Field

AS_FAR = 2.0
"""Times that a reading stands further off than both next to it. Beside a single spike in a stroke
that moves others are off as well, by what it moves in two samples."""


class Expected(NamedTuple):
    """Noiseless readings of a smoothed record and their variance, (samples, channels) [SI]."""

    read: np.ndarray
    variance: np.ndarray


def doubtful(field: Field, sd: np.ndarray) -> np.ndarray:
    """Which readings stand off their neighbours alone, (samples, channels).

    - `sd` (channels,): of noise and rounding [SI].
    """
    count = len(field.setup.channels)
    channel = np.repeat(np.arange(count), field.samples)
    data, read = field.reading.T.ravel(), field.known.T.ravel() > 0
    laid = Readings(data, read, sd[channel], np.zeros_like(data), channel, channel)
    off = (off_neighbours(laid, data) / laid.sd).reshape(count, -1).T
    beside = np.pad(off, ((1, 1), (0, 0)))
    alone = off > AS_FAR * np.maximum(beside[:-2], beside[2:])
    far = off > SPIKE
    far[:, list(field.setup.recorded)] = False  # what was done is taken as it was recorded
    return far & alone & (far.sum(axis=1, keepdims=True) == 1)


def contradicted(field: Field, expected: Expected, sd: np.ndarray) -> np.ndarray:
    """Which readings are not what the others say, (samples, channels); `sd` as of `doubtful`."""
    # Of a reading told to a part in a million the variance is a difference that rounding leaves.
    variance = np.maximum(expected.variance, 0.0) + sd**2
    return np.abs(field.reading - expected.read) > SPIKE * np.sqrt(variance)


def listed(field: Field, aside: np.ndarray) -> tuple[Aside, ...]:
    """What was set aside of a record, by channel; `aside` (samples, channels)."""
    time = field.first + field.interval * np.arange(field.samples)
    return tuple(
        Aside(field.name, one.place, one.quantity, tuple(time[mask].tolist()))
        for one, mask in zip(field.setup.channels, aside.T, strict=True)
        if mask.any()
    )
