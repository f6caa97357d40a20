"""Score tests of all candidates at once, once all else has absorbed what it can."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from rigid.discovery.traces import Expansion


class Screening(NamedTuple):
    """What the records say of each candidate's amplitude, all other parameters refitted.

    - `slope` (k,): of the log-posterior by the amplitude, where it is absent.
    - `information` (k, k): of all amplitudes together, the rest projected out.
    """

    slope: np.ndarray
    information: np.ndarray

    @property
    def strength(self) -> np.ndarray:
        """Signed strength of each (k,): slope over its standard deviation where nothing is."""
        return self.slope / np.sqrt(np.diag(self.information))

    @property
    def estimate(self) -> np.ndarray:
        """Most probable amplitude of each alone (k,), before its prior."""
        return self.slope / np.diag(self.information)

    @property
    def cosines(self) -> np.ndarray:
        """Cosines of the traces (k, k): 1 where two leave the same once all else has absorbed."""
        size = np.sqrt(np.diag(self.information))
        return self.information / np.outer(size, size)


def screen(around: Expansion, traces: np.ndarray) -> Screening:
    """Test every candidate.

    - `traces` (samples, k): change of the expected record per unit amplitude.

    The fit's parameters have unit normal priors; its own slope is 0 at its optimum, up to where
    the solver stopped. Source: Rao's score test, with nuisance parameters projected out; Cox and
    Hinkley 1974, Theoretical Statistics, sec. 9.3.
    """
    weighted = around.design * around.bend[:, None]
    known = cho_factor(np.eye(around.design.shape[1]) + around.design.T @ weighted)
    shared = weighted.T @ traces
    left = traces.T @ (around.bend[:, None] * traces) - shared.T @ cho_solve(known, shared)
    return Screening(traces.T @ around.score, left)
