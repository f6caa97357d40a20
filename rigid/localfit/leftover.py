"""How far residuals resemble their neighbours once all signatures have explained what they can.

Hundreds of signatures explain noise as well, above all the slow part of it: what they leave looks
less correlated than it was, and every strength that is judged by it comes out too large. How much
they take is found by simulation: noise of a known correlation goes through the same explaining.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.signal import lfilter

from rigid.likelihood.correlation import (
    LEAST_SAMPLES,
    MAX_ORDER,
    Autoregression,
    autocovariance,
    of_covariance,
)
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import gram

TRACE_SD = 15.0
"""Prior sd of each signature, in units of its own strength: enough for all that is asked of."""
PRICE = 2.0
"""Of an order of the autoregression (AIC). BIC takes short ones for noise that is coloured and
rounded, whose memory then comes out a tenth too short; here too long does less harm."""
ROUNDS, DRAWS = 3, 8
"""Of the simulation, and series in each. After three the times stand still to 2 %."""
SETTLING = 100
"""Samples before the first in which simulated noise forgets that it began."""


@dataclasses.dataclass(frozen=True)
class Explaining:
    """Regression of all scores on parameters and signatures together.

    - `score`, `curvature` (n,): of the fit. - `parts`: parameters and signatures, (n, some) each, k
      in all. - `unit` (k,): what one of each is multiplied by. - `gradient` (k,) of their priors.
    - `known`: Cholesky factor of their information, in these units.
    """

    score: np.ndarray
    curvature: np.ndarray
    parts: tuple[np.ndarray, ...]
    unit: np.ndarray
    gradient: np.ndarray
    known: tuple[np.ndarray, bool]

    @classmethod
    def by(cls, local: LocalFit, signatures: np.ndarray) -> "Explaining":
        """Lay out parameters and signatures (n, k) of a fit."""
        curvature, fitted = local.terms.curvature, len(local.w)
        parts = (local.design, signatures)
        both = gram(parts, curvature)
        size = np.sqrt(np.maximum(np.diag(both)[fitted:], 0.0))
        # what no sample shows explains nothing
        unit = np.concatenate([np.ones(fitted), 1.0 / np.where(size > 0.0, size, np.inf)])
        spread = np.concatenate([np.ones(fitted), np.full(len(size), TRACE_SD)])
        known = cho_factor(np.diag(spread**-2.0) + both * np.outer(unit, unit))
        gradient = np.concatenate([-local.w, np.zeros(len(size))])
        return cls(local.terms.score, curvature, parts, unit, gradient, known)

    @property
    def left(self) -> np.ndarray:
        """Scores (n, 1) that nothing explains."""
        return self._left(self.score[:, None], self.gradient[:, None])

    def left_of(self, noise: np.ndarray) -> np.ndarray:
        """What would be left of scores (n, draws) that are all noise."""
        return self._left(noise, np.zeros((len(self.gradient), 1)))

    def _left(self, scores: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        unit = self.unit[:, None]
        slope = unit * np.concatenate([part.T @ scores for part in self.parts])
        amplitudes = unit * cho_solve(self.known, slope + gradient)
        ends = np.cumsum([part.shape[1] for part in self.parts])[:-1]
        each = zip(self.parts, np.split(amplitudes, ends), strict=True)
        return scores - self.curvature[:, None] * sum(part @ mine for part, mine in each)


def noise_laws(
    explaining: Explaining, rows: Sequence[np.ndarray], good: np.ndarray
) -> list[Autoregression]:
    """Autoregression that the scores of each channel's noise follow.

    - `rows`: masks (n,) of the channels. - `good` (n,): where samples count.

    Noise is sought that leaves, on average, the autocovariances that are left: what the explaining
    takes from those of simulated noise is added to those that were found, and so again.
    """
    rng = np.random.default_rng(0)
    white = [rng.standard_normal((SETTLING + mine.sum(), DRAWS)) for mine in rows]
    here = [good[mine] for mine in rows]
    orders = [int(min(MAX_ORDER, g.sum() // 10)) for g in here]

    def covariances(series: np.ndarray) -> list[np.ndarray]:
        parts = zip(rows, here, orders, strict=True)
        return [autocovariance(series[m], g, o).mean(axis=1) for m, g, o in parts]

    found = sought = covariances(explaining.left)
    for _ in range(ROUNDS):
        noise = np.zeros((len(good), DRAWS))
        for mine, fresh, law in zip(rows, white, _laws(sought, here), strict=True):
            noise[mine] = coloured(law, fresh)
        noise[~good] = 0.0
        taken = zip(covariances(noise), covariances(explaining.left_of(noise)), strict=True)
        sought = [f + (a - b) for f, (a, b) in zip(found, taken, strict=True)]
    return _laws(sought, here)


def _laws(covariances: Sequence[np.ndarray], good: Sequence[np.ndarray]) -> list[Autoregression]:
    counts = [int(g.sum()) for g in good]
    return [
        of_covariance(c if n >= LEAST_SAMPLES else c[:1], n, PRICE)
        for c, n in zip(covariances, counts, strict=True)
    ]


def coloured(law: Autoregression, white: np.ndarray) -> np.ndarray:
    """Noise by an autoregression from white noise (SETTLING + n, draws), (n, draws)."""
    innovation = np.sqrt(law.variance) * white
    noise = np.asarray(lfilter([1.0], [1.0, *-law.coefficients], innovation, axis=0))
    return noise[SETTLING:]
