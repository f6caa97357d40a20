"""The mixture of Student-t laws laid over the modes of the posterior, and the modes' weights."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import gammaln

from rigid.io.errors import UnusableResultError

Random = np.random.Generator | np.random.RandomState
LogProb = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Mode:
    """One maximum of the posterior and the Gaussian around it.

    - mean: (d,), where the maximum is
    - covariance_factor: (d, d), lower Cholesky factor of the covariance
    - log_posterior: log of the unnormalised posterior density at the maximum
    """

    mean: NDArray[np.float64]
    covariance_factor: NDArray[np.float64]
    log_posterior: float

    def __post_init__(self) -> None:
        d = len(self.mean)
        if self.covariance_factor.shape != (d, d):
            raise ValueError(f"factor {self.covariance_factor.shape} for a mean of {d}")
        if not np.all(np.diagonal(self.covariance_factor) > 0.0):
            raise ValueError("the diagonal of the Cholesky factor must be positive")


@dataclass(frozen=True, eq=False)
class MixtureProposal:
    """A mixture of multivariate Student-t laws, one or two over each mode.

    - modes: k of them; the covariance of a mode is the scale matrix of its law
    - weights: (laws,), positive, made to sum to one
    - dof: degrees of freedom. Six: the density ratio of a Gaussian posterior stays bounded, and a
      tail some three times heavier than the Gaussian covers a posterior that is skewed
    - wider: none, or for each mode a law that goes farther, after those of the modes. Where
      converters round to steps wider than the noise, the posterior can be a narrow peak on a wide
      shoulder, and the curvature at the mode tells the peak alone.

    Source: multivariate t as in Kotz and Nadarajah (2004), eq. (1.1); a wider law beside the one
    that fits is the defensive mixture of Hesterberg (1995), Technometrics 37.
    """

    modes: tuple[Mode, ...]
    weights: NDArray[np.float64]
    dof: float = 6.0
    wider: tuple[Mode, ...] = ()

    def __post_init__(self) -> None:
        weights = np.asarray(self.weights, dtype=float)
        if len(self.wider) not in (0, len(self.modes)):
            raise ValueError(f"{len(self.wider)} wider laws for {len(self.modes)} modes")
        if weights.shape != (len(self.laws),) or not np.all(weights >= 0.0) or weights.sum() <= 0:
            raise ValueError(f"weights {weights} for {len(self.laws)} laws")
        if abs(weights.sum() - 1.0) > 1e-12:  # else leave every bit: a resumed chain needs them
            weights = weights / weights.sum()
        object.__setattr__(self, "weights", weights)

    @property
    def laws(self) -> tuple[Mode, ...]:
        """Those of the modes, then the wider ones."""
        return self.modes + self.wider

    @property
    def dimension(self) -> int:
        """Length of z."""
        return len(self.modes[0].mean)

    def sample(self, rng: Random, n: int) -> NDArray[np.float64]:
        """Draw n points, (n, d)."""
        which = rng.choice(len(self.laws), size=n, p=self.weights)
        normal = rng.standard_normal((n, self.dimension))
        stretch = np.sqrt(self.dof / rng.chisquare(self.dof, n))
        steps = np.einsum("nij,nj->ni", self._factors[which], normal)
        return self._means[which] + stretch[:, None] * steps

    def sample_apart(self, rng: Random, n: int) -> NDArray[np.float64]:
        """Draw n points, (n, d), each of a law between that over a mode and the standard normal.

        Centre and widths go from those of the mode to those of the prior, in the logarithm of the
        widths; a quarter of the points go by less than half of the way.
        """
        which = rng.choice(len(self.laws), size=n, p=self.weights)
        way = np.sqrt(rng.uniform(size=(n, 1)))
        normal = rng.standard_normal((n, self.dimension))
        variance, axes = np.linalg.eigh(self._factors @ np.swapaxes(self._factors, 1, 2))
        steps = variance[which] ** (0.5 * (1.0 - way)) * normal
        return (1.0 - way) * self._means[which] + np.einsum("nij,nj->ni", axes[which], steps)

    def log_density(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log density at z (n, d) -> (n,)."""
        return np.logaddexp.reduce(self._log_joint(z), axis=1)

    def mode_of(self, z: NDArray[np.float64]) -> NDArray[np.intp]:
        """Index of the mode each point of z (n, d) most probably belongs to, (n,)."""
        return np.argmax(self._by_mode(self._log_joint(z)), axis=1)

    def shares(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probability that each point of z (n, d) belongs to each mode, (n, k)."""
        joint = self._by_mode(self._log_joint(z))
        return np.exp(joint - np.logaddexp.reduce(joint, axis=1, keepdims=True))

    def shared(self, shares: NDArray[np.float64]) -> "MixtureProposal":
        """Return the mixture in which each mode has the weight that `shares` (k,) says."""
        own = self.weights.reshape(-1, len(self.modes))
        return replace(self, weights=(own / own.sum(axis=0) * shares).ravel())

    def alone(self, mode: int) -> "MixtureProposal":
        """Return the mixture over one mode."""
        own = self.weights.reshape(-1, len(self.modes))[:, mode]
        return replace(
            self, modes=(self.modes[mode],), weights=own, wider=self.wider[mode : mode + 1]
        )

    def responsibilities(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probability that each point of z (n, d) was drawn from each law, (n, laws)."""
        joint = self._log_joint(z)
        return np.exp(joint - np.logaddexp.reduce(joint, axis=1, keepdims=True))

    def _log_joint(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log of weight times density of each law at z, (n, laws)."""
        d, dof = self.dimension, self.dof
        laws = zip(self._means, self._inverses, strict=True)
        # einsum, for the threads of a triangular solver cost 200 times the sum itself.
        whitened = [np.einsum("nj,ij->ni", z - mean, inverse) for mean, inverse in laws]
        distance = np.stack([np.sum(w**2, axis=1) for w in whitened], axis=1)
        return self._log_heights - (dof + d) / 2 * np.log1p(distance / dof)

    def _by_mode(self, joint: NDArray[np.float64]) -> NDArray[np.float64]:
        """Logs (n, laws) of each law as those of each mode, (n, k)."""
        return np.logaddexp.reduce(joint.reshape(len(joint), -1, len(self.modes)), axis=1)

    @cached_property
    def _means(self) -> NDArray[np.float64]:
        return np.stack([law.mean for law in self.laws])

    @cached_property
    def _factors(self) -> NDArray[np.float64]:
        return np.stack([law.covariance_factor for law in self.laws])

    @cached_property
    def _inverses(self) -> NDArray[np.float64]:
        unit = np.eye(self.dimension)
        return np.stack([solve_triangular(factor, unit, lower=True) for factor in self._factors])

    @cached_property
    def _log_heights(self) -> NDArray[np.float64]:
        d, dof = self.dimension, self.dof
        constant = gammaln((dof + d) / 2) - gammaln(dof / 2) - d / 2 * np.log(dof * np.pi)
        log_det = np.sum(np.log(np.diagonal(self._factors, axis1=1, axis2=2)), axis=1)
        with np.errstate(divide="ignore"):  # a weight of zero is allowed
            return np.log(self.weights) + constant - log_det


@dataclass(frozen=True, eq=False)
class ModeWeights:
    """How much of the posterior each mode holds, by importance sampling.

    - weights: (k,), sum to one
    - error: (k,), Monte Carlo standard error of each weight
    - log_evidence: log of the integral of the unnormalised posterior
    - kish: effective share of the draws, (sum w)^2 / (n sum w^2); 1 is perfect
    - pareto_k: shape of the tail of the importance weights; above 0.7 the figures are unreliable
    - failed: draws whose log posterior was not a number
    - greatest: log weight of a draw, against the mixture in which every mode has the same weight
    """

    weights: NDArray[np.float64]
    error: NDArray[np.float64]
    log_evidence: float
    kish: float
    pareto_k: float
    failed: int
    greatest: float


def mode_weights(
    log_prob: LogProb, proposal: MixtureProposal, rng: Random, draws: int
) -> ModeWeights:
    """Evidence of each mode, found without any walker: where a chain began plays no part.

    - log_prob: (n, d) -> (n,), unnormalised log posterior
    - draws: number of points drawn from the laws over each mode

    Every draw is weighted with the mixture of all laws, and shared out between the modes by the
    probability of each under Laplace's weights: shares sum to one, so that what two overlapping
    modes both cover is counted once.

    Raises UnusableResultError when no draw has a finite log posterior.
    Source: Owen and Zhou (2000), "Safe and effective importance sampling".
    """
    k = len(proposal.modes)
    z = np.concatenate([proposal.alone(i).sample(rng, draws) for i in range(k)])
    raw = np.asarray(log_prob(z), dtype=float)
    failed = np.isnan(raw) | (raw == np.inf)
    log_weight = np.where(failed, -np.inf, raw)
    if not np.any(np.isfinite(log_weight)):
        raise UnusableResultError(
            f"none of {len(z)} points drawn around the best fits has a finite posterior: their "
            "covariance is wrong, or the model fails next to them"
        )
    log_weight = log_weight - proposal.shared(np.ones(k)).log_density(z)
    weight = np.exp(log_weight - log_weight.max())
    shares = proposal.shared(_laplace_weights(proposal.modes)).shares(z)
    weights = weight @ shares
    weights = weights / weights.sum()  # to the last bit, so that a mode alone has weight 1
    influence = (weight[:, None] * (shares - weights)).reshape(k, draws, k)
    variance = draws * influence.var(axis=1, ddof=1).sum(axis=0)
    return ModeWeights(
        weights=weights,
        error=np.sqrt(variance) / weight.sum() if k > 1 else np.zeros(1),
        log_evidence=float(np.logaddexp.reduce(log_weight) - np.log(len(z))),
        kish=kish(weight) / len(z),
        pareto_k=pareto_shape(weight),
        failed=int(np.sum(failed)),
        greatest=float(log_weight.max()),
    )


def kish(weight: NDArray[np.float64]) -> float:
    """How many independent draws weights (n,) are worth."""
    return float(weight.sum() ** 2 / (weight**2).sum())


def _laplace_weights(modes: tuple[Mode, ...]) -> NDArray[np.float64]:
    """Share of each mode if it were the Gaussian around its maximum; only ratios matter here."""
    logs = np.array(
        [m.log_posterior + np.sum(np.log(np.diagonal(m.covariance_factor))) for m in modes]
    )
    return np.exp(np.maximum(logs - logs.max(), -500.0))  # exp(-500) is small, and not zero


UNRELIABLE = 0.7
"""Pareto shape from which on sums over weighted draws cannot be trusted: their law does not cover
the posterior. Source: Vehtari et al. (2024), section 3."""


def pareto_shape(weight: NDArray[np.float64]) -> float:
    """Shape k of the generalised Pareto law fitted to the largest weights (n,).

    Of one's own, since no one function of ArviZ serves both of its versions in use: 0.23 has
    `psislw` of log weights, 1.x has it as a method of arrays alone, and of minus the log weights.

    Source: Zhang and Stephens (2009), eqs. (4)-(8), with the weak prior on k and the tail length
    min(n/5, 3 sqrt(n)) of Vehtari et al. (2024), section 2.4.
    """
    n = len(weight)
    tail = int(min(n / 5, 3 * np.sqrt(n)))
    if tail < 5:
        return float("inf")
    ordered = np.sort(weight)
    excess = ordered[-tail:] - ordered[-tail - 1]
    if excess[-1] <= 1e-12 * ordered[-1]:  # equal weights: no tail at all
        return float("-inf")
    excess = np.maximum(excess, 1e-300)
    m = 30 + int(np.sqrt(tail))
    quartile = excess[int(tail / 4 + 0.5) - 1]
    theta = 1 - np.sqrt(m / (np.arange(1, m + 1) - 0.5))
    theta = theta / (3 * max(quartile, 1e-12 * excess[-1])) + 1 / excess[-1]
    k = np.mean(np.log1p(-theta[:, None] * excess), axis=1)
    profile = tail * (np.log(-theta / k) - k - 1)
    posterior = np.exp(profile - np.logaddexp.reduce(profile))
    shape = np.mean(np.log1p(-np.sum(theta * posterior) * excess))
    return float((shape * tail + 10 * 0.5) / (tail + 10))
