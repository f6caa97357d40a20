"""Noise that grows with how fast a reading moves: instants of samples that jitter.

A sample taken d s too late is off by d times the rate of its reading. Where a logger's instants
jitter by some percent of an interval, steep readings are as far off as a missing effect would leave
them, and count too much if their noise is that of the sheet.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from rigid.likelihood.correlation import LEAST_SAMPLES, noise_law
from rigid.localfit.local import LocalFit

TRIED = np.concatenate([[0.0], np.geomspace(1e-3, 0.5, 48)])
"""Sds of the instants that are tried, in intervals."""

BENT, HALF = 0.25, 0.5
"""A reading bends where the change on one side of a sample is less than this share of that on the
other; then a sample that jitters is off by half of the greater."""


def louder(local: LocalFit, left: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Variance of each sample's noise over that of its sheet (n,), at least 1.

    - `local`: a fit. - `left` (n,): scores that nothing explains. - `good` (n,): what counts.

    Instants are the logger's: all channels with one interval share their jitter. What a record does
    on its own is no jitter, so that of each is told by the others. Where those of its interval do
    not tell, channels of other intervals do, which are taken to jitter by the same share of theirs,
    as far as the channel's own scores allow: hundreds of signatures explain the few steep samples
    of a release. Where there are no others at all it is jitter if it turns from sample to sample as
    only chance does, before anything explains it: what swings or lags does not.
    """
    layout, out = local.layout, np.ones(len(left))
    rate, known = np.zeros(len(left)), np.zeros(len(left))
    gains: dict[int, np.ndarray] = {}
    rows: dict[int, np.ndarray] = {}
    for number in range(len(layout.channels)):
        mine = layout.channel == number
        if mine.sum() < 3 or not good[mine].any():
            continue
        rate[mine] = _steepest(local.reading[mine])
        rows[number] = some = np.flatnonzero(mine & good & (local.terms.curvature > 0.0))
        # A rounded sample says most where its score is largest: its own curvature would scale that.
        known[mine] = local.terms.curvature[some].mean() if len(some) else 0.0
        gains[number] = _gains(left[some], known[some], rate[some])
    price = 0.5 * np.log(max(int(good.sum()), 2))

    def own(number: int, by: Callable[..., np.ndarray]) -> np.ndarray:
        some = rows[number]
        return by(local.terms.score[some], known[some], rate[some])

    def jitter(number: int) -> float:
        others = [i for i in gains if layout.channels[i].track != layout.channels[number].track]
        alike = _alike(local, list(gains), number)
        same = [i for i in others if i in alike]
        told = np.sum([gains[i] for i in same] or [own(i, _by_chance) for i in alike], axis=0)
        if told.max() - told[0] <= price and others:
            told = np.sum([gains[i] for i in others], axis=0)
            if told.max() - told[0] > price:
                told = told + own(number, _gains)
        best = int(np.argmax(told))
        # What asks for the greatest that is tried asks for more, and is no jitter.
        jitters = told[best] - told[0] > price and best < len(TRIED) - 1
        return float(TRIED[best]) if jitters else 0.0

    for number in gains:
        mine = layout.channel == number
        if found := jitter(number):
            out[mine] = _variance(local.reading[mine], found, known[mine])
    return out


class Jitter(NamedTuple):
    """Jitter that scores ask for before anything explains them.

    - `variance`: as of `louder`. - `log_bayes`: against instants that are right, all sds that are
      tried as probable.
    """

    variance: np.ndarray
    log_bayes: float


def asked_for(local: LocalFit) -> Jitter | None:
    """What all channels of an interval together ask for, where none of them is taken to jitter.

    Signatures explain steep samples away, and who looks at what they leave sees no jitter. Whether
    it is jitter or something missing, the evidence for either has to say. Channels whose scores do
    not turn by chance ask for none: what swings or lags is no jitter. None where no interval does.

    - `local`: a fit whose weights have what `louder` found.
    """
    layout, log_bayes, asked = local.layout, 0.0, False
    price = 0.5 * np.log(max(int((layout.weight > 0.0).sum()), 2))
    variance = np.ones(len(layout.weight))
    for interval in {channel.interval for channel in layout.channels}:
        told, rows = np.zeros(len(TRIED)), []
        for number, channel in enumerate(layout.channels):
            mine = layout.channel == number
            some = np.flatnonzero(mine & (layout.weight > 0.0))
            if channel.interval != interval or len(some) < LEAST_SAMPLES:
                continue
            facts, known = layout.weight[some], local.terms.curvature[some]
            if not np.allclose(facts, facts[0]) or not known.any():
                continue  # it has some already, or tells nothing
            level, rate = known.mean(), _steepest(local.reading[mine])[layout.weight[mine] > 0.0]
            scores, even = local.terms.score[some], np.full(len(some), level)
            told += facts[0] * _by_chance(scores, even, rate)
            rows.append((mine, level))
        best = int(np.argmax(told))
        if told[best] - told[0] > price and best < len(TRIED) - 1:
            asked = True
            log_bayes += float(np.asarray(logsumexp(told - told[0]))) - float(np.log(len(TRIED)))
            for mine, level in rows:
                variance[mine] = _variance(local.reading[mine], TRIED[best], level)
    return Jitter(variance, log_bayes) if asked else None


def _variance(reading: np.ndarray, jitter: float, known: np.ndarray | float) -> np.ndarray:
    """Variance of a channel's noise (m,) over its sheet's; `known`: one over that, a sample."""
    off = np.where(_bent(reading), HALF, jitter) * _steepest(reading)
    return 1.0 + off**2 * known


def _bent(reading: np.ndarray) -> np.ndarray:
    """Where a reading (m,) bends between samples: steep on one side, and hardly so on the other.

    How steep it is at the sample itself is not known there: a pressure may jump within a tenth of
    an interval, and a sample in the jump is off by a part of it. Nor is it at both ends.
    """
    steps = np.abs(np.diff(reading))
    sides = np.stack([np.append(steps, 0.0), np.append(0.0, steps)])
    return sides.min(axis=0) < BENT * sides.max(axis=0)


def _steepest(reading: np.ndarray) -> np.ndarray:
    """Change of a reading (m,) to the sample before or after it, whichever is the greater.

    Where a valve opens, a sample that comes late is already on the steep side.
    """
    steps = np.abs(np.diff(reading))
    return np.maximum(np.append(steps, 0.0), np.append(0.0, steps))


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
