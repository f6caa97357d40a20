"""How far residuals resemble their neighbours once all signatures have explained what they can.

Hundreds of signatures explain noise as well, above all the slow part of it: what they leave looks
less correlated than it was, and every strength that is judged by it comes out too large. How much
they take is found by simulation: noise of a known correlation goes through the same explaining.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.signal import lfilter
from scipy.special import expit, logit

from rigid.likelihood.correlation import LEAST_SAMPLES
from rigid.likelihood.noise_spectrum import (
    LONGEST,
    WHITE,
    Classes,
    CommonLaw,
    Found,
    NoiseLaw,
    common_law,
    law_of,
    periodogram,
)
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import gram

TRACE_SD = 15.0
"""Prior sd of each signature, in units of its own strength: enough for all that is asked of."""
ROUNDS, DRAWS = 3, 8
"""Of the simulation, and series in each. After three the times stand still to 2 %."""
LIKE_OTHERS = 0.9
"""Probability beforehand that a record's noise is that of the other records of its sensor."""
SLOW = 5.0
"""Memory, in sums of a sensor's autocorrelations, of what a channel lacks to be as slow."""
SETTLED = 5.0
"""Memories before the first sample in which simulated noise forgets that it began."""


class Traces(NamedTuple):
    """Signatures of all that may be missing.

    - `columns` (n, k). - `timed` (k,): which go by the time of one record, anywhere in it. Slow
      noise looks the same; what it is, the other records of a sensor tell.
    - `wandering` (k,): which of these are of one sensor alone.
    """

    columns: np.ndarray
    timed: np.ndarray
    wandering: np.ndarray

    @classmethod
    def of(cls, columns: np.ndarray) -> "Traces":
        """Signatures (n, k) of which none goes by the time of one record."""
        none = np.zeros(columns.shape[1], dtype=bool)
        return cls(columns, none, none)


@dataclasses.dataclass(frozen=True)
class Explaining:
    """Regression of all scores on parameters and signatures together.

    - `score`, `curvature` (n,): of the fit. - `parts`: parameters and signatures, (n, some) each, k
      in all. - `products` (k, k): of them. - `unit` (k,): what one of each is multiplied by.
    - `gradient` (k,) of their priors. - `precision` (k,): of these, in these units.
    """

    score: np.ndarray
    curvature: np.ndarray
    parts: tuple[np.ndarray, ...]
    products: np.ndarray
    unit: np.ndarray
    gradient: np.ndarray
    precision: np.ndarray

    @classmethod
    def by(cls, local: LocalFit, signatures: np.ndarray) -> "Explaining":
        """Lay out parameters and signatures (n, k) of a fit."""
        curvature, fitted = local.terms.curvature, len(local.w)
        parts = (local.design, signatures)
        products = gram(parts, curvature)
        size = np.sqrt(np.maximum(np.diag(products)[fitted:], 0.0))
        # what no sample shows explains nothing
        unit = np.concatenate([np.ones(fitted), 1.0 / np.where(size > 0.0, size, np.inf)])
        spread = np.concatenate([np.ones(fitted), np.full(len(size), TRACE_SD)])
        gradient = np.concatenate([-local.w, np.zeros(len(size))])
        return cls(local.terms.score, curvature, parts, products, unit, gradient, spread**-2.0)

    def without(self, signatures: np.ndarray) -> "Explaining":
        """Return the same without some of the signatures, by mask."""
        fitted = len(self.unit) - len(signatures)
        gone = np.concatenate([np.zeros(fitted, dtype=bool), signatures])
        return dataclasses.replace(self, unit=np.where(gone, 0.0, self.unit))

    @cached_property
    def known(self) -> tuple[np.ndarray, bool]:
        """Cholesky factor of the information of all together, in these units."""
        information = self.products * np.outer(self.unit, self.unit)
        return cho_factor(np.diag(self.precision) + information)

    @property
    def left(self) -> np.ndarray:
        """Scores (n, 1) that nothing explains."""
        return self._left(self.score[:, None], self.gradient[:, None])

    @cached_property
    def explained(self) -> np.ndarray:
        """Change of the expected readings (n,) that explains most of the scores."""
        return self._changes(self.score[:, None], self.gradient[:, None])[:, 0]

    def leverage(self, rows: np.ndarray) -> np.ndarray:
        """Share of each sample's own score in what is explained of it, for some rows (m,)."""
        factor, lower = self.known
        across = 0 if lower else 1
        columns = np.concatenate([part[rows] for part in self.parts], axis=1) * self.unit
        solved = solve_triangular(factor, columns.T, trans=across, lower=lower)
        return np.asarray(self.curvature[rows] * np.sum(solved**2, axis=0))

    def left_of(self, noise: np.ndarray) -> np.ndarray:
        """What would be left of scores (n, draws) that are all noise."""
        return self._left(noise, np.zeros((len(self.gradient), 1)))

    def _left(self, scores: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        return scores - self.curvature[:, None] * self._changes(scores, gradient)

    def _changes(self, scores: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        unit = self.unit[:, None]
        slope = unit * np.concatenate([part.T @ scores for part in self.parts])
        amplitudes = unit * cho_solve(self.known, slope + gradient)
        ends = np.cumsum([part.shape[1] for part in self.parts])[:-1]
        each = zip(self.parts, np.split(amplitudes, ends), strict=True)
        return np.asarray(sum(part @ mine for part, mine in each))


class Wandering(NamedTuple):
    """Noise of a channel, and how slow that of its sensor is.

    - `own`: law of what is left of the channel. - `usual`: that of the sensor's records together,
      with the channel's `level`, its variance.
    """

    own: NoiseLaw
    usual: NoiseLaw
    level: float

    @property
    def law(self) -> NoiseLaw:
        """The slower of the two."""
        return max(self.own, self.usual, key=lambda law: law.time)

    @property
    def parts(self) -> tuple[NoiseLaw, ...]:
        """Laws whose sum is as quick as the channel's own noise, and as slow as its sensor.

        A part that fades slowly takes the small share of the variance with which all of it has the
        sensor's time. What is quick differs from record to record of a sensor that rounds: where it
        stands still its noise turns over a step now and then, where it moves with every sample.
        """
        more = self.usual.time - self.own.time
        if more <= 0.0:
            return (self.own,)
        memory = max(self.usual.memory, SLOW * self.usual.time)
        decay = float(np.exp(-1.0 / memory))
        share = more / ((1.0 + decay) / (1.0 - decay) - self.own.time)
        innovations = share * self.level * (1.0 - decay**2)
        slow = NoiseLaw(np.array([decay]), self.usual.time, innovations, memory=memory)
        return self.own._replace(variance=(1.0 - share) * self.own.variance), slow


def noise_laws(
    local: LocalFit, explaining: Explaining, traces: Traces, good: np.ndarray
) -> list[Wandering]:
    """Laws that the scores of each channel's noise follow.

    - `explaining`: by all that may be missing, the `traces`. - `good` (n,): where samples count.

    What goes by the time of one record is something missing or is noise: noise in as far as the
    sensor does so in its other records. So each channel has two laws, of which the slower counts:
    that of what is left once such things are explained as well, and that of the records of its
    sensor where they are not; among these is the record itself in as far as its noise may be that
    of the others. A sensor of one record alone has none to tell: what wanders in it is noise, and
    what moves other sensors too is not.
    """
    layout = local.layout
    rows = [layout.channel == number for number in range(len(layout.channels))]
    own = left_by(explaining, rows, good)
    if not traces.timed.any():
        return [Wandering(one.law, one.law, one.level) for one in own]
    sensors = [(channel.sensor, channel.interval) for channel in layout.channels]
    alike = [
        [i for i, its in enumerate(sensors) if its == mine and i != number]
        for number, mine in enumerate(sensors)
    ]
    wide = left_by(explaining.without(traces.timed), rows, good)
    lone = own
    if not all(alike) and traces.wandering.any():
        lone = left_by(explaining.without(traces.wandering), rows, good)
    laws = []
    for number, one in enumerate(own):
        level = one.level
        if others := [wide[i] for i in alike[number]]:
            usual = _usual(wide[number], others, level)
        else:
            usual = _common([lone[number]], level).law
        laws.append(Wandering(one.law, usual, level))
    return laws


class Left(NamedTuple):
    """What an explaining leaves of a channel's scores: what they show, their law, samples read."""

    found: Found
    law: NoiseLaw
    read: int

    @property
    def level(self) -> float:
        """Variance of the noise."""
        return self.law.variance if self.found.empty else self.found.level

    @classmethod
    def of(
        cls, power: np.ndarray, good: np.ndarray, usual: float, left: np.ndarray | None = None
    ) -> "Left":
        """Fit the law of a periodogram (m,).

        - `good` (n,): what counts. - `usual`: variance where nothing tells it, as the sheet has it.
        - `left` (b,): as in `Found.of`.
        """
        found, read = Found.of(power, left), int(good.sum())
        if found.empty or read < LEAST_SAMPLES:
            level = usual if found.empty else found.level
            return cls(found, WHITE._replace(variance=level), read)
        return cls(found, law_of(found, float(np.log(read))), read)


def _usual(mine: Left, others: Sequence[Left], level: float) -> NoiseLaw:
    """Law of the noise that a sensor's record would have as the others have it.

    - `mine`: what is left of it; it counts in as far as its noise may be that of the `others`.
    - `level`: variance that the law is to have.
    """
    apart, alone, all_alike = (_common(some, level) for some in (others, [mine], [mine, *others]))
    log_odds = all_alike.log_evidence - apart.log_evidence - alone.log_evidence
    like = float(expit(logit(LIKE_OTHERS) + log_odds))
    times = all_alike.law.time, apart.law.time
    return apart.law._replace(time=like * times[0] + (1.0 - like) * times[1])


def _common(some: Sequence[Left], level: float) -> CommonLaw:
    price = float(np.log(max(sum(one.read for one in some), 2)))
    return common_law([one.found for one in some], price, level)


def left_by(explaining: Explaining, rows: Sequence[np.ndarray], good: np.ndarray) -> list[Left]:
    """What an explaining leaves of each channel's noise.

    - `rows`: masks (n,) of the channels. - `good` (n,): where samples count.

    How much of each frequency the explaining leaves is found from simulated noise of the law so
    far; with that share the law is held against what is left of the scores, and so again.
    """
    rng, most = np.random.default_rng(0), int(np.ceil(SETTLED * LONGEST))
    here = [good[mine] for mine in rows]
    white = [rng.standard_normal((most + len(mine), DRAWS)) for mine in here]

    def powers(series: np.ndarray) -> list[np.ndarray]:
        return [periodogram(series[m], mine) for m, mine in zip(rows, here, strict=True)]

    known = np.where(good, np.maximum(explaining.curvature, 0.0), 0.0)
    usual = [float(known[m].sum() / max(mine.sum(), 1)) for m, mine in zip(rows, here, strict=True)]
    found = powers(explaining.left)
    out = [Left.of(*one) for one in zip(found, here, usual, strict=True)]
    for _ in range(ROUNDS):
        noise = np.zeros((len(good), DRAWS))
        for m, mine, fresh, one in zip(rows, here, white, out, strict=True):
            noise[m] = coloured(one.law, fresh[-settling(one.law) - len(mine) :])
        noise[~good] = 0.0
        shares = map(_share, powers(noise), powers(explaining.left_of(noise)))
        out = [Left.of(*one) for one in zip(found, here, usual, shares, strict=True)]
    return out


def _share(whole: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Share of a periodogram (m,) that is left, in classes of frequencies (b,)."""
    classes = Classes.of(len(whole))
    if not len(whole):
        return np.zeros(0)
    before = classes.mean(whole)
    there = before > 0.0
    share = np.where(there, classes.mean(rest) / np.where(there, before, 1.0), 0.0)
    return np.clip(share, 0.0, 1.0)


def settling(law: NoiseLaw) -> int:
    """Samples in which noise of a law forgets that it began."""
    return int(np.ceil(SETTLED * law.memory))


def coloured(law: NoiseLaw, white: np.ndarray) -> np.ndarray:
    """Noise of a law from white noise (settling + n, draws), (n, draws)."""
    innovation = np.sqrt(law.variance) * white
    noise = lfilter([1.0, *law.averages], [1.0, *-law.coefficients], innovation, axis=0)
    return np.asarray(noise)[settling(law) :]
