"""Score tests of all candidates at once, once all else has absorbed what it can."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve


class Around(NamedTuple):
    """The log-likelihood of all samples around a fit.

    - `score`, `curvature` (n,): slope and minus curvature by the expected record.
    - `design` (n, size): slope of the expected record by what the fit adjusts, in prior sds.
    - `gradient` (size,): slope of the log-posterior by the latter; 0 at an optimum.
    """

    score: np.ndarray
    curvature: np.ndarray
    design: np.ndarray
    gradient: np.ndarray


class Screening(NamedTuple):
    """What the records say of each candidate's amplitude, all other parameters refitted.

    - `slope` (k,): of the log-posterior by the amplitude, where it is absent.
    - `information` (k, k): of all amplitudes together, the rest projected out.
    """

    slope: np.ndarray
    information: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """Strength of a unit of each amplitude (k,); never quite 0."""
        return np.sqrt(np.maximum(np.diag(self.information), 1e-200))

    @property
    def strength(self) -> np.ndarray:
        """Signed strength of each (k,): slope over its standard deviation where nothing is."""
        return self.slope / self.size

    @property
    def estimate(self) -> np.ndarray:
        """Most probable amplitude of each alone (k,), before its prior."""
        return self.slope / self.size**2

    @property
    def cosines(self) -> np.ndarray:
        """Cosines of the signatures (k, k), each less what all else absorbs of it."""
        return self.information / np.outer(self.size, self.size)

    def only(self, which: np.ndarray) -> "Screening":
        """Return the tests of some of the columns."""
        return Screening(self.slope[which], self.information[np.ix_(which, which)])


LOST = 1e-13
"""Part of a signature's information below which what the fit has not absorbed is rounding of
readings that were simulated to ten digits or so."""
ROWS = 1024
"""Samples that are multiplied at a time: most signatures are 0 in most of these, and left out
there."""


def gram(parts: Sequence[np.ndarray], curvature: np.ndarray) -> np.ndarray:
    """Products of columns with each other, samples weighted by `curvature` (n,): (k, k).

    - `parts`: the columns, (n, some) each, k in all; they are put side by side a few samples at a
      time, for all together take gigabytes.
    """
    out = np.zeros((sum(part.shape[1] for part in parts),) * 2)
    for begin in range(0, len(curvature), ROWS):
        rows = slice(begin, begin + ROWS)
        here = np.concatenate([part[rows] for part in parts], axis=1)
        some = np.flatnonzero(here.any(axis=0))
        here = here[:, some]
        out[np.ix_(some, some)] += here.T @ (here * curvature[rows, None])
    return out


def screen(around: Around, signatures: np.ndarray) -> Screening:
    """Test every candidate.

    - `signatures` (n, k): change of the expected record per unit amplitude.

    The fit's parameters have unit normal priors. A signature of which nothing is left, or that lies
    where no sample tells, has slope and information 0. Source: Rao's score test, with nuisance
    parameters projected out; Cox and Hinkley 1974, Theoretical Statistics, sec. 9.3. Information is
    a sum of squares of what is left of each sample, not a difference of large numbers: no direction
    has less than nothing, however much of a signature the fit absorbs.
    """
    curvature = np.maximum(around.curvature, 0.0)  # of heavy tails, far out, it may be less
    weighted = around.design * curvature[:, None]
    known = cho_factor(np.eye(around.design.shape[1]) + around.design.T @ weighted)
    absorbed = cho_solve(known, weighted.T @ signatures)
    alone = np.einsum("nk,n,nk->k", signatures, curvature, signatures)
    information = absorbed.T @ absorbed  # what the priors say against absorbing that much
    slope = absorbed.T @ (around.design.T @ around.score - around.gradient)
    for begin in range(0, len(signatures), ROWS):
        rows = slice(begin, begin + ROWS)
        left = signatures[rows] - around.design[rows] @ absorbed
        slope += left.T @ around.score[rows]
        left *= np.sqrt(curvature[rows, None])
        information += left.T @ left
    seen = np.diag(information) > LOST * alone
    return Screening(np.where(seen, slope, 0.0), information * np.outer(seen, seen))
