"""How loads and valves are believed to move before a record is looked at.

In each sampling interval a load, its slope and a flow fraction move by Gaussian steps whose
variance is that interval's own. The variances follow an inverse gamma law, so that a movement has
a Student law: mostly small, now and then as large as it likes. A brittle drop or a turn of the
valve then is one interval with a large variance, and is followed at once, while the calm about it
is smoothed. The law of the variances given the record is found by variational Bayes (Bishop,
Pattern Recognition, section 10.1; Lange, Little and Taylor 1989, JASA 84), its scales are those of
greatest evidence (`learning`).

Within an interval the variance is even. The band between two samples then is as wide as it has to
be for a movement whose instant is not known: a jump at a random instant has the same covariance.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import digamma, gammaln

START = (0.01, 1e-3, 1e-4)
"""Scales from which learning begins, of loads, slopes and flow fractions, in units of their sizes:
on the rig 10 N, 100 N/s and 1e-5 in one sampling interval."""

LEAST = (1e-4, 1e-5, 1e-6)
"""Scales so small that they stand for no movement but rare ones."""

DOF = 0.12
"""Degrees of freedom of the Student laws. In tails this heavy 47 % of all movements would be more
than a hundred scales wide and 36 % more than a thousand: that the load falls costs next to nothing,
however small the scale is that the calm asks for. With 1 the bands about drops were too narrow."""


class Movement(NamedTuple):
    """The law of the movements and what the record says of each interval, in units of scales.

    Leading axes count candidates, if there are several.

    - `scale` (..., inputs): of the Student law in one sampling interval. - `dof`.
    - `rate` (..., samples, inputs): of the gamma law of each interval's 1/variance.
    - `seen` (..., samples, inputs): square of the smoothed movement, as `rate` counts it.
    - `steps`: that an interval is parted into.
    """

    scale: np.ndarray
    dof: float
    rate: np.ndarray
    seen: np.ndarray
    steps: int

    @property
    def shape(self) -> float:
        """Shape of the gamma laws."""
        return 0.5 * (self.dof + self.steps)

    @property
    def precision(self) -> np.ndarray:
        """Mean of 1/variance of each interval."""
        return self.shape / self.rate

    @property
    def variances(self) -> np.ndarray:
        """Variance of the movement in each of an interval's steps."""
        return 1.0 / (self.precision * self.steps)

    def rescaled(self, scale: np.ndarray) -> "Movement":
        """Return the same intervals under another law; `scale` (..., inputs).

        What a movement owes to its law follows the scale, what was seen of it stays.
        """
        factor = (scale / self.scale)[..., None, :] ** 2
        seen = np.minimum(0.5 * self.seen, self.rate)
        return self._replace(scale=scale, rate=factor * (self.rate - seen) + seen)


def calm(samples: int, steps: int, scale: np.ndarray) -> Movement:
    """Return inputs of which no interval is known to have moved; `scale` (..., inputs)."""
    rate = 0.5 * (DOF + steps) * scale**2
    wide = np.broadcast_to(rate[..., None, :], (*rate.shape[:-1], samples, rate.shape[-1]))
    return Movement(scale, DOF, wide, np.zeros_like(wide), steps)


def updated(movement: Movement, moved: np.ndarray, variance: np.ndarray) -> Movement:
    """Take in smoothed movements and their variances, (..., samples, steps, inputs)."""
    seen = movement.steps * np.sum(moved**2, axis=-2)
    squares = seen + movement.steps * np.sum(variance, axis=-2)
    rate = 0.5 * (movement.dof * movement.scale[..., None, :] ** 2 + squares)
    return movement._replace(rate=rate, seen=seen)


def bound(movement: Movement, evidence: np.ndarray) -> np.ndarray:
    """Lower bound of the log-evidence of the law, (...,).

    - `evidence` (...,): log-probability of the readings with the movement's `variances`.
    """
    shape, rate = movement.shape, movement.rate
    first, prior = 0.5 * movement.dof, 0.5 * movement.dof * movement.scale[..., None, :] ** 2
    log_precision = digamma(shape) - np.log(rate)
    spread = 0.5 * movement.steps * (log_precision - np.log(shape / rate))
    apart = (shape - first) * digamma(shape) - gammaln(shape) + gammaln(first)
    apart = apart + first * np.log(rate / prior) + shape * (prior - rate) / rate
    return evidence + np.sum(spread - apart, axis=(-2, -1))
