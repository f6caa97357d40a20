"""How many facts a series of residuals holds: the law of its noise, by BIC.

Residuals of neighbouring samples that resemble each other carry less than their number says. The
sum of n scores whose autocorrelation time is tau varies as that of n/tau independent ones, so the
log-likelihood of the channel is multiplied by 1/tau: its curvature then is what the estimates
really scatter by (magnitude adjustment of a composite likelihood: Ribatet, Cooley and Davison
2012, Statistica Sinica 22). Without correlation tau is exactly 1.
"""

import numpy as np
from scipy.signal import lfilter

from rigid.likelihood.noise_spectrum import WHITE, NoiseLaw, law_of
from rigid.likelihood.periodogram import Found, periodogram

LEAST_SAMPLES = 20
"""Of a series whose correlation can be judged."""


def noise_law(residual: np.ndarray, valid: np.ndarray) -> NoiseLaw:
    """Fit the law of a series.

    - `residual`, `valid` (n,): the series and where it was read.
    """
    read = int(valid.sum())
    if read < LEAST_SAMPLES:
        return WHITE
    return law_of(Found.of(periodogram(residual, valid)), float(np.log(read)))


def ahead(law: NoiseLaw, residual: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """One-step-ahead residuals (n,); where a predecessor is missing, its mean 0 stands in."""
    clean = np.where(valid, residual, 0.0)
    out = lfilter([1.0, *-law.coefficients], [1.0, *law.averages], clean)
    return np.where(valid, np.asarray(out), np.nan)


def autocovariance(residual: np.ndarray, valid: np.ndarray, lags: int) -> np.ndarray:
    """Autocovariance about 0 at lags 0 to `lags`, over the pairs of which both were read.

    - `residual` (n, ...): one or more series. - `valid` (n,).
    """
    clean = np.where(valid.reshape(-1, *[1] * (residual.ndim - 1)), residual, 0.0)
    n = len(clean)
    found = [np.sum(clean[k:] * clean[: n - k], axis=0) for k in range(lags + 1)]
    return np.array(found) / max(valid.sum(), 1)
