"""Noise that grows with how fast a reading moves: instants of samples that jitter.

A sample taken d s too late is off by d times the rate of its reading. Where a logger's instants
jitter by some percent of an interval, steep readings are as far off as a missing effect would leave
them, and count too much if their noise is that of the sheet.
"""

from collections.abc import Sequence

import numpy as np

from rigid.likelihood.correlation import noise_law
from rigid.localfit.local import LocalFit

TRIED = np.concatenate([[0.0], np.geomspace(1e-3, 0.5, 48)])
"""Sds of the instants that are tried, in intervals."""


def louder(local: LocalFit, left: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Variance of each sample's noise over that of its sheet (n,), at least 1.

    - `local`: a fit. - `left` (n,): scores that nothing explains. - `good` (n,): what counts.

    Instants are the logger's: all channels with one interval share their jitter. What a record does
    on its own is no jitter, so that of each is told by the others. Where there are none it is
    jitter if it turns from sample to sample as only chance does, before anything explains it: what
    swings or lags does not, and hundreds of signatures explain any few samples.
    """
    layout, out = local.layout, np.ones(len(left))
    rate = np.zeros(len(left))
    gains: dict[int, np.ndarray] = {}
    rows: dict[int, np.ndarray] = {}
    for number in range(len(layout.channels)):
        mine = layout.channel == number
        reading, time = local.reading[mine], layout.time[mine]
        if len(time) < 3 or not good[mine].any():
            continue
        rate[mine] = layout.channels[number].interval * np.gradient(reading, time)
        rows[number] = np.flatnonzero(mine & good & (local.terms.curvature > 0.0))
        some = rows[number]
        gains[number] = _gains(left[some], local.terms.curvature[some], rate[some])

    def alone(number: int) -> np.ndarray:
        some = rows[number]
        return _by_chance(local.terms.score[some], local.terms.curvature[some], rate[some])

    for number in gains:
        alike = _alike(local, list(gains), number)
        others = [i for i in alike if layout.channels[i].track != layout.channels[number].track]
        told = np.sum([gains[i] for i in others] or [alone(i) for i in alike], axis=0)
        price = 0.5 * np.log(max(int(good.sum()), 2))
        best = int(np.argmax(told))
        if told[best] - told[0] > price:
            mine = layout.channel == number
            known = local.terms.curvature[mine]
            out[mine] = 1.0 + (TRIED[best] * rate[mine]) ** 2 * np.maximum(known, 0.0)
    return out


def _alike(local: LocalFit, numbers: Sequence[int], one: int) -> list[int]:
    """Channels with the interval of one, itself among them."""
    channels = local.layout.channels
    return [i for i in numbers if channels[i].interval == channels[one].interval]


def _gains(scores: np.ndarray, curvature: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Log-likelihood of a channel's scores at each jitter of TRIED, its noise level at its best."""
    if not len(scores):
        return np.zeros(len(TRIED))
    square, known = scores**2 / curvature, rate**2 * curvature
    variance = 1.0 + TRIED[:, None] ** 2 * known
    level = np.mean(square / variance, axis=1, keepdims=True)
    return -0.5 * np.sum(np.log(np.maximum(level, 1e-300) * variance) + 1.0, axis=1)


def _by_chance(scores: np.ndarray, curvature: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """The same; 0 unless the scores are white at the jitter that is the likeliest."""
    gains = _gains(scores, curvature, rate)
    jitter = TRIED[int(np.argmax(gains))]
    even = scores / np.sqrt(curvature + (jitter * rate * curvature) ** 2)
    white = noise_law(even, np.ones(len(even), dtype=bool)).time == 1.0
    return gains if white else np.zeros(len(TRIED))
