"""Whether an optimum is one: the gradient vanishes there, and no number is far from its prior.

A search that ends in the wrong place mostly betrays itself. Either it ended on a slope, or it
stands where the priors say that no rig is: a strap that lets go slowly, fitted as one that goes at
once, moves the bulk modulus of the oil by twelve sds of its prior. Both are told before anything
else is believed of the fit.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import norm

AWAY = 0.7
"""Posterior sds that an optimum may be away from where its expansion has the top. Models led to
their optima side by side may end 0.2 nats below it, which is sqrt(2 0.2) = 0.63 of them
(`rigid.localfit.ascent`); a search ends within 0.05 nats, 0.32 of them."""

CHANCE = 1e-3
"""With which any of the numbers of a right model is called far: z of the best fit is scattered over
models like the prior, or less."""


@dataclasses.dataclass(frozen=True)
class Settled:
    """What is to be said of a place where a search ended.

    - `away` [posterior sds]: no number is further from the top of the expansion there.
    - `far`: labels of numbers too far from the centres of their priors, and by how many prior sds,
      the farthest first. - `limit` [prior sds]: what is too far among so many numbers.
    - `driven`: the same of numbers that are far, but no farther than the discrepancy of a law that
      explains much may drive them; then there are none in `far`.
    """

    away: float
    far: tuple[tuple[str, float], ...]
    limit: float
    driven: tuple[tuple[str, float], ...] = ()

    @property
    def flat(self) -> bool:
        """Whether the gradient vanishes, in posterior sds."""
        return self.away <= AWAY

    @property
    def ok(self) -> bool:
        """Whether the place can be believed to be the optimum of a right model."""
        return self.flat and not self.far

    @property
    def says(self) -> str:
        """What was found, in a sentence."""
        return self.why or (
            f"the gradient vanishes there, to {self.away:.2f} posterior sds (limit {AWAY}); every "
            f"{'other ' if self.driven else ''}number lies near the centre of its prior (limit "
            f"{self.limit:.1f} prior sds){self.warning and '; '}{self.warning}"
        )

    @property
    def warning(self) -> str:
        """What is driven by the discrepancy of a law, in a sentence; mostly empty."""
        if not self.driven:
            return ""
        numbers = ", ".join(stands(label, sds) for label, sds in self.driven)
        return f"{numbers}: a law that is not exact drives this, so do not quote it"

    @property
    def why(self) -> str:
        """Why not, in sentences; empty where it is settled."""
        said = []
        if self.far:
            label, sds = self.far[0]
            others = f", and {len(self.far) - 1} more are too far" if len(self.far) > 1 else ""
            said.append(
                f"{stands(label, sds)} (limit {self.limit:.1f}){others}: something else is wrong"
            )
        if not self.flat:
            said.append(
                f"the search ended {self.away:.1f} posterior sds from the optimum (limit {AWAY})"
            )
        return "; ".join(said)


def stands(label: str, sds: float) -> str:
    """Where a number stands beside its prior, in words."""
    return f"{label} is {abs(sds):.1f} prior sds {'above' if sds > 0 else 'below'} its prior"


def away_from_top(gradient: np.ndarray, information: np.ndarray) -> float:
    """Posterior sds that no number is further from the top of an expansion.

    - `gradient` (size,): slope of the log-posterior or of minus it. - `information` (size, size):
      minus its Hessian, prior included.

    The bound on every number at once is that of Cauchy and Schwarz: an entry of I^-1 g, in its own
    posterior sd, is at most sqrt(g I^-1 g). Infinite where the information is none of a maximum.
    """
    try:
        step = cho_solve(cho_factor(information), gradient)
    except (ValueError, np.linalg.LinAlgError):  # slopes that are no numbers, or grow without bound
        return np.inf
    return float(np.sqrt(max(gradient @ step, 0.0)))


def settled(labels: Sequence[str], w: np.ndarray, away: float) -> Settled:
    """Judge a place where a search ended.

    - `labels`: of the entries of `w` (size,), which are on the scale of their priors.
    - `away` [posterior sds]: from the top of the expansion there, as `away_from_top` gives it.
    """
    limit = float(norm.isf(0.5 * CHANCE / len(w)))
    order = np.argsort(-np.abs(w))
    far = tuple((str(labels[i]), float(w[i])) for i in order if abs(w[i]) > limit)
    return Settled(away, far, limit)
