"""How much better the records are explained with an effect than without, as log Bayes factors.

All of it rests on the quadratic expansion around a fit (`rigid.localfit.screening`): with
slope g and information I of an amplitude a, the likelihood ratio is exp(g a - I a^2/2), whatever
the records; what is left is one integral over the amplitude's prior.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import logsumexp

from rigid.likelihood.priors import AbstractPrior

STANDARD = np.linspace(-6.0, 6.0, 2401)
"""Quantiles, on the standard normal scale, over which priors of amplitudes are summed."""
LOG_MASS = np.log(np.exp(-0.5 * STANDARD**2) / np.exp(-0.5 * STANDARD**2).sum())

STRENGTHS = np.geomspace(2.0, 30.0, 9)
"""Strengths that a hidden force may have, all as probable: their sum in squares."""
WIDER_STRENGTHS = np.geomspace(2.0, 2000.0, 41)
"""Strengths that are tried of one that is absorbed."""


def amplitudes(prior: AbstractPrior, absent: float) -> np.ndarray:
    """Departures of an amplitude from where it is absent, at STANDARD."""
    return np.asarray(prior.from_standard(STANDARD)) - absent


def log_bayes(slope: ArrayLike, information: ArrayLike, departures: np.ndarray) -> np.ndarray:
    """Log Bayes factor of an amplitude against its absence, for slopes of any shape.

    - `slope`, `information`: of the log-likelihood at absence. - `departures`: from `amplitudes`.
    """
    slopes, informations = np.broadcast_arrays(slope, information)
    flat = np.stack([slopes.ravel(), informations.ravel()])
    out = np.empty(flat.shape[1])
    for begin in range(0, len(out), 256):  # 256 x 2401 numbers at a time
        g, i = flat[:, begin : begin + 256]
        exponent = g[:, None] * departures - 0.5 * i[:, None] * departures**2
        out[begin : begin + 256] = logsumexp(exponent + LOG_MASS, axis=1)
    return out.reshape(slopes.shape)


def of_gaussian(values: np.ndarray, along: np.ndarray, variance: np.ndarray | float) -> np.ndarray:
    """Log Bayes factor (...,) of Gaussian amplitudes of one variance against none.

    - `values`, `along` (..., r): information and slope along its eigenvectors. - `variance`:
      broadcasts with them.
    """
    scaled = 1.0 + variance * values
    return np.asarray(0.5 * np.sum(variance / scaled * along**2 - np.log(scaled), axis=-1))


def mean_of(logs: np.ndarray) -> np.ndarray:
    """Logarithm of the mean of exponentials over the last axis."""
    return np.asarray(logsumexp(logs, axis=-1) - np.log(np.shape(logs)[-1]))


def most_probable(slope: float, information: float, departures: np.ndarray) -> float:
    """Standard normal quantile at which an amplitude explains most, its prior in."""
    exponent = slope * departures - 0.5 * information * departures**2 + LOG_MASS
    return float(STANDARD[int(np.argmax(exponent))])


ROUNDING = 1e-10
"""Information along a direction of a bundle, over that along the one which records tell best, below
which it is rounding: there records say nothing, and amplitudes stay where their prior has them."""


class Bundle:
    """A hidden force, flow or distortion: several amplitudes of unknown common size.

    - `columns` (m,): which of the screened signatures belong to it.
    """

    def __init__(self, columns: np.ndarray, information: np.ndarray):
        self.columns = columns
        self._size = np.sqrt(np.maximum(np.diag(information)[columns], 1e-200))
        part = information[np.ix_(columns, columns)] / np.outer(self._size, self._size)
        values, axes = np.linalg.eigh(part)
        told = values > ROUNDING * max(float(values[-1]), 0.0)
        self._values, self._axes = values[told], axes[:, told]
        # Variances of the amplitudes at which the expected strength is that of STRENGTHS.
        self._variances = STRENGTHS**2 / max(float(self._values.sum()), 1e-12)

    def log_bayes(self, slope: np.ndarray) -> np.ndarray:
        """Log Bayes factor against nothing (...,) for slopes (..., k) of what was screened."""
        along = (slope[..., self.columns] / self._size) @ self._axes
        each = [of_gaussian(self._values, along, variance) for variance in self._variances]
        return mean_of(np.stack(each, axis=-1))

    def sizes(self, slope: np.ndarray) -> np.ndarray:
        """Sd of each amplitude (m,) at the common size that explains most.

        - `slope` (k,): of what was screened.

        The strengths that are tried here go on beyond STRENGTHS: what stays in a model should not
        be held back by a prior that is there to weigh what is small.
        """
        along = (slope[self.columns] / self._size) @ self._axes
        variances = WIDER_STRENGTHS**2 / max(float(self._values.sum()), 1e-12)
        gains = of_gaussian(self._values, along, variances[:, None])
        return np.sqrt(variances[int(np.argmax(gains))]) / self._size

    @property
    def rank(self) -> int:
        """Number of directions in which records say something of the amplitudes."""
        return len(self._values)

    def slopes(self, whitened: np.ndarray) -> np.ndarray:
        """Slopes (..., m) of its signatures from standard normal numbers (..., rank)."""
        return (whitened * np.sqrt(self._values)) @ self._axes.T * self._size

    def amplitudes(self, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (m,) and covariance (m, m) of the amplitudes given slopes (k,)."""
        along = (slope[self.columns] / self._size) @ self._axes
        weights = of_gaussian(self._values, along, self._variances[:, None])
        means, covariances = [], []
        for variance in self._variances:
            shrunk = variance / (1.0 + variance * self._values)
            means.append(self._axes @ (shrunk * along))
            untold = variance * (np.eye(len(self.columns)) - self._axes @ self._axes.T)
            covariances.append((self._axes * shrunk) @ self._axes.T + untold)
        share = np.exp(weights - logsumexp(weights))
        mean = np.einsum("v,vm->m", share, np.array(means))
        off = np.array(means) - mean
        covariance = np.einsum("v,vmk->mk", share, np.array(covariances))
        covariance += np.einsum("v,vm,vk->mk", share, off, off)
        return mean / self._size, covariance / np.outer(self._size, self._size)
