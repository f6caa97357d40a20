"""The law of noise that several series share, and how sure it is."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp, softmax

from rigid.likelihood.noise_spectrum import (
    WHITE,
    NoiseLaw,
    Tried,
    Whittle,
    bounded,
    of_parts,
    scaled,
    times_of,
)
from rigid.likelihood.periodogram import Found


class Likely(NamedTuple):
    """Laws of noise, the quickest first.

    - `size` (m, 1 + parts): variances of the white noise and of parts that fade, over the level of
      a series. - `decay` (m, parts). - `weight` (m,): how likely each is; 1 in all.
    """

    size: np.ndarray
    decay: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, tried: Sequence[Tried], log_weight: np.ndarray) -> "Likely":
        """Put laws together: white noise, then those that were tried, as `log_weight` has them."""
        most = max((one.decay.shape[1] for one in tried), default=0)
        size, decay = [np.eye(1, 1 + most)], [np.zeros((1, most))]
        for one in tried:
            more = ((0, 0), (0, most - one.decay.shape[1]))
            size.append(np.pad(one.size, more))
            decay.append(np.pad(one.decay, more))
        sizes, decays = np.concatenate(size), np.concatenate(decay)
        order = np.argsort(times_of(sizes, decays), kind="stable")
        return cls(sizes[order], decays[order], softmax(log_weight)[order])

    @property
    def time(self) -> np.ndarray:
        """Sum of all autocorrelations of each law (m,)."""
        return times_of(self.size, self.decay)

    def at(self, place: np.ndarray) -> np.ndarray:
        """Return the numbers (draws,) of the laws that so many of all, 0 to 1, do not outlast."""
        reached = np.cumsum(self.weight)
        return np.minimum(np.searchsorted(reached, place * reached[-1]), len(reached) - 1)

    def law(self, number: int) -> NoiseLaw:
        """One of them."""
        return of_parts(self.size[number, 0], self.size[number, 1:], self.decay[number])


class CommonLaw(NamedTuple):
    """The law that several series share but for their size.

    - `law`: the likeliest, but for its `time`: that is the mean over all laws, each as likely as it
      is. Few frequencies tell of a part that lasts long; the simplest law that they allow may have
      a third of its time.
    - `log_evidence`: of all laws together. - `likely`: these.
    """

    law: NoiseLaw
    log_evidence: float
    likely: Likely


def common_law(found: Sequence[Found], price: float, level: float) -> CommonLaw:
    """Fit the law that several series share but for their size.

    - `price`: of a number, as in `law_of`. - `level`: variance that it is to have.
    """
    some = [one for one in found if not one.empty]
    if not some:
        return CommonLaw(WHITE._replace(variance=level), 0.0, Likely.of((), np.zeros(1)))
    whittle = Whittle.of(some, price)
    tried = tuple(whittle.tried())
    fits = [whittle.white(), *map(whittle.best, tried)]
    law, logs = min(fits, key=lambda fit: fit.cost).law, whittle.log_weights(tried)
    likely = Likely.of(tried, logs)
    law = law._replace(time=bounded(float(likely.weight @ likely.time)))
    return CommonLaw(scaled(law, level), float(np.asarray(logsumexp(logs))), likely)
