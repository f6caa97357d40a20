"""How many facts a series of residuals holds: autoregression, order by BIC.

Residuals of neighbouring samples that resemble each other carry less than their number says. The
sum of n scores whose autocorrelation time is tau varies as that of n/tau independent ones, so the
log-likelihood of the channel is multiplied by 1/tau: its curvature then is what the estimates
really scatter by (magnitude adjustment of a composite likelihood: Ribatet, Cooley and Davison
2012, Statistica Sinica 22). Without correlation the order is 0 and tau exactly 1.
"""

import dataclasses

import numpy as np
from scipy.linalg import solve_toeplitz

MAX_ORDER = 8
"""Longer memory shows as a pole near 1 of these; residuals are those of a fitted model."""

LEAST_SAMPLES = 20
"""Of a series whose correlation can be judged."""

LEAST_SHARE = 0.002
"""tau is at most n / (n * LEAST_SHARE): a channel whose residuals are all trend still counts."""


@dataclasses.dataclass(frozen=True)
class Autoregression:
    """r[k] = sum of coefficients[j] r[k-1-j] + innovation.

    - `coefficients` (order,). - `time` [samples]: sum of the autocorrelations, at least 1.
    - `variance`: of the innovation.
    """

    coefficients: np.ndarray
    time: float
    variance: float = 1.0

    def ahead(self, residual: np.ndarray, valid: np.ndarray) -> np.ndarray:
        """One-step-ahead residuals (n,); where a predecessor is missing, its mean 0 stands in."""
        clean = np.where(valid, residual, 0.0)
        out = clean.copy()
        for lag, coefficient in enumerate(self.coefficients, start=1):
            out[lag:] -= coefficient * clean[:-lag]
        return np.where(valid, out, np.nan)


def autocovariance(residual: np.ndarray, valid: np.ndarray, lags: int) -> np.ndarray:
    """Autocovariance about 0 at lags 0 to `lags`, over the pairs of which both were read.

    - `residual` (n, ...): one or more series. - `valid` (n,).
    """
    clean = np.where(valid.reshape(-1, *[1] * (residual.ndim - 1)), residual, 0.0)
    n = len(clean)
    found = [np.sum(clean[k:] * clean[: n - k], axis=0) for k in range(lags + 1)]
    return np.array(found) / max(valid.sum(), 1)


def autoregression(residual: np.ndarray, valid: np.ndarray) -> Autoregression:
    """Fit an autoregression, the order by BIC.

    - `residual`, `valid` (n,): the series and where it was read.
    """
    n = int(valid.sum())
    if n < LEAST_SAMPLES:
        return Autoregression(np.zeros(0), 1.0)
    covariance = autocovariance(residual, valid, min(MAX_ORDER, n // 10))
    return of_covariance(covariance, n, float(np.log(n)))


def of_covariance(covariance: np.ndarray, n: int, price: float) -> Autoregression:
    """Fit an autoregression by Yule-Walker.

    - `covariance` (orders + 1,): of a series at lags from 0 on. - `n`: samples it is of.
    - `price`: of an order, in twice the log-likelihood: log n for BIC, 2 for AIC.
    """
    if covariance[0] <= 0.0:
        return Autoregression(np.zeros(0), 1.0)
    best, best_variance = np.zeros(0), float(covariance[0])
    best_cost = n * np.log(best_variance)
    for order in range(1, len(covariance)):
        coefficients = solve_toeplitz(covariance[:order], covariance[1 : order + 1])
        variance = float(covariance[0] - coefficients @ covariance[1 : order + 1])
        if variance <= 0.0:
            break
        cost = n * np.log(variance) + order * price
        if cost < best_cost:
            best, best_cost, best_variance = coefficients, cost, variance
    longest = 1.0 / LEAST_SHARE
    gain = max(1.0 - best.sum(), 1e-6)
    time = best_variance / gain**2 / covariance[0]
    return Autoregression(best, float(np.clip(time, 1.0, longest)), best_variance)
