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

from rigid.likelihood.common_noise import CommonLaw, common_law
from rigid.likelihood.correlation import LEAST_SAMPLES
from rigid.likelihood.noise_spectrum import LONGEST, SETTLED, WHITE, NoiseLaw, law_of, scaled
from rigid.likelihood.periodogram import Classes, Found, Read, periodogram
from rigid.localfit.local import LocalFit
from rigid.localfit.noise.codes import Codes
from rigid.localfit.screening import gram

TRACE_SD = 15.0
"""Prior sd of each signature, in units of its own strength: enough for all that is asked of."""
ROUNDS, DRAWS = 3, 8
"""Of the simulation, and series in each. After three the times stand still to 2 %."""
LIKE_OTHERS = 0.9
"""Probability beforehand that a record's noise is that of the other records of its sensor."""


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


class Left(NamedTuple):
    """What an explaining leaves of a channel's scores: what they show, their law, samples read."""

    found: Found
    law: NoiseLaw
    read: int

    @property
    def level(self) -> float:
        """Variance of the noise."""
        return self.law.variance if self.found.empty else self.found.level

    def of_sheet(self) -> "Left":
        """Return the same with a variance of 1."""
        return self._replace(law=scaled(self.law, 1.0 / self.law.power))

    @classmethod
    def of(
        cls,
        power: np.ndarray,
        good: np.ndarray,
        usual: float,
        left: np.ndarray | None = None,
        read: Read | None = None,
    ) -> "Left":
        """Fit the law of a periodogram (m,).

        - `good` (n,): what counts. - `usual`: variance where nothing tells it, as the sheet has it.
        - `left` (b,), `read`: as in `Found.of`.
        """
        found, count = Found.of(power, left, read), int(good.sum())
        if found.empty or count < LEAST_SAMPLES:
            level = usual if found.empty else found.level
            return cls(found, WHITE._replace(variance=level), count)
        price = float(np.log(count))
        if read is None:
            return cls(found, law_of(found, price), count)
        # what is told through a converter shows no swing
        return cls(found, common_law([found], price, found.level).law, count)


def common(some: Sequence[Left], level: float) -> CommonLaw:
    """Fit the law that the noise of some records shares; `level`: variance it is to have."""
    price = float(np.log(max(sum(one.read for one in some), 2)))
    return common_law([one.found for one in some], price, level)


class Shared(NamedTuple):
    """Law that a channel shares with the other records of its sensor, and that of these alone.

    - `like`: probability that it is one law.
    """

    alike: CommonLaw
    apart: CommonLaw
    like: float

    @classmethod
    def of(cls, mine: Left, others: Sequence[Left], level: float) -> "Shared":
        """Fit both; the evidence tells how likely the first is.

        - `level`: variance that laws are to have.
        """
        apart, alone, alike = (common(some, level) for some in (others, [mine], [mine, *others]))
        log_odds = alike.log_evidence - apart.log_evidence - alone.log_evidence
        return cls(alike, apart, float(expit(logit(LIKE_OTHERS) + log_odds)))


class Told(NamedTuple):
    """What is left of a channel's noise, and of that of its sensor.

    What goes by the time of one record is something missing or is noise: noise in as far as the
    sensor does so in its other records.

    - `own`: once such things are explained as well. - `mine`: where they are not; None where there
      are none. - `others`: the same of the sensor's other records. A sensor of one record alone has
      none to tell: what wanders in it is noise, and what moves other sensors too is not.
    """

    own: Left
    mine: Left | None
    others: tuple[Left, ...]

    @property
    def law(self) -> NoiseLaw:
        """Its law or that of the sensor's records, whichever is the slower."""
        return max(self.own.law, self._usual, key=lambda law: law.time)

    @property
    def _usual(self) -> NoiseLaw:
        """Law of the noise that the record would have as the others of its sensor have it."""
        level = self.own.level
        if self.mine is None:
            return self.own.law
        if not self.others:
            return common([self.mine], level).law
        shared = Shared.of(self.mine, self.others, level)
        times = shared.alike.law.time, shared.apart.law.time
        time = shared.like * times[0] + (1.0 - shared.like) * times[1]
        return shared.apart.law._replace(time=time)


def noise_laws(
    local: LocalFit, explaining: Explaining, traces: Traces, good: np.ndarray
) -> list[NoiseLaw]:
    """Laws that the scores of each channel's noise follow; as in `noise_told`."""
    return [one.law for one in noise_told(local, explaining, traces, good)]


def noise_told(
    local: LocalFit,
    explaining: Explaining,
    traces: Traces,
    good: np.ndarray,
    codes: Codes | None = None,
) -> list[Told]:
    """Work out what is left of the noise of each channel.

    - `explaining`: by all that may be missing, the `traces`. - `good` (n,): where samples count.
    - `codes`: as in `left_by`.
    """
    layout = local.layout
    rows = [layout.channel == number for number in range(len(layout.channels))]
    own = left_by(explaining, rows, good, codes)
    if not traces.timed.any():
        return [Told(one, None, ()) for one in own]
    sensors = [(channel.sensor, channel.interval) for channel in layout.channels]
    alike = [
        [i for i, its in enumerate(sensors) if its == mine and i != number]
        for number, mine in enumerate(sensors)
    ]
    wide = left_by(explaining.without(traces.timed), rows, good, codes)
    lone = own
    if not all(alike) and traces.wandering.any():
        lone = left_by(explaining.without(traces.wandering), rows, good, codes)
    return [
        Told(one, wide[i] if alike[i] else lone[i], tuple(wide[j] for j in alike[i]))
        for i, one in enumerate(own)
    ]


def left_by(
    explaining: Explaining,
    rows: Sequence[np.ndarray],
    good: np.ndarray,
    codes: Codes | None = None,
) -> list[Left]:
    """What an explaining leaves of each channel's noise.

    - `rows`: masks (n,) of the channels. - `good` (n,): where samples count. - `codes`: where the
      law sought is that of the noise before its converter, in sds; without them it is that of the
      scores.

    How much of each frequency converter and explaining leave is found from simulated noise of the
    law so far; with that share the law is held against what is left of the scores, and so again.
    """
    rng, most = np.random.default_rng(0), int(np.ceil(SETTLED * LONGEST))
    here = [good[mine] for mine in rows]
    white = [rng.standard_normal((most + len(mine), DRAWS)) for mine in here]
    units = np.ones(len(rows)) if codes is None else codes.unit

    def powers(series: np.ndarray) -> list[np.ndarray]:
        all_of = zip(rows, here, units, strict=True)
        return [periodogram(unit * series[m], mine) for m, mine, unit in all_of]

    known = np.where(good, np.maximum(explaining.curvature, 0.0), 0.0)
    usual = [
        float(known[m].sum() / max(mine.sum(), 1)) if codes is None else 1.0
        for m, mine in zip(rows, here, strict=True)
    ]
    found = powers(explaining.left)
    rounded = np.zeros(len(rows)) if codes is None else codes.step

    def told(shares: Sequence[np.ndarray | None], reads: Sequence[Read | None]) -> list[Left]:
        laws = [Left.of(*one) for one in zip(found, here, usual, shares, reads, strict=True)]
        return [law.of_sheet() if step else law for law, step in zip(laws, rounded, strict=True)]

    none = [None] * len(rows)
    out = told(none, none)
    for _ in range(ROUNDS):
        noise = np.zeros((len(good), DRAWS))
        drawn = [
            coloured(one.law, fresh[-one.law.settling - len(mine) :])
            for mine, fresh, one in zip(here, white, out, strict=True)
        ]
        for number, (m, one) in enumerate(zip(rows, drawn, strict=True)):
            noise[m] = one if codes is None else codes.of_noise(number, one)
        noise[~good] = 0.0
        read, after = powers(noise), powers(explaining.left_of(noise))
        left = [np.minimum(_share(*both), 1.0) for both in zip(read, after, strict=True)]
        reads = [
            Read.of(periodogram(one, mine), now) if step else None
            for one, mine, now, step in zip(drawn, here, read, rounded, strict=True)
        ]
        out = told(left, reads)
    return out


def _share(whole: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Share of a periodogram (m,) that is left, in classes of frequencies (b,)."""
    classes = Classes.of(len(whole))
    if not len(whole):
        return np.zeros(0)
    before = classes.mean(whole)
    there = before > 0.0
    return np.where(there, classes.mean(rest) / np.where(there, before, 1.0), 0.0)


def coloured(law: NoiseLaw, white: np.ndarray) -> np.ndarray:
    """Noise of a law from white noise (settling + n, draws), (n, draws)."""
    innovation = np.sqrt(law.variance) * white
    noise = lfilter([1.0, *law.averages], [1.0, *-law.coefficients], innovation, axis=0)
    return np.asarray(noise)[law.settling :]
