"""The proposal over the modes fitted to what weighted draws of it say of the posterior."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigid.inference.proposal import LogProb, MixtureProposal, Mode, Random, kish

LEAST_WEIGHT = 1e-3
"""Of a mode, so that none found is never proposed."""
LEAST_FAR = 0.05
"""Of a wider law, times the weight of its mode's own, so that what is far is watched for."""
ROUNDS = 4
EVEN = 0.2
"""Share of effective draws of a fitted proposal from which on it is good enough."""


class Weighted(NamedTuple):
    """Draws z (n, d) of a proposal, for a posterior.

    - `log_prob` (n,): of the posterior, unnormalised. - `log_weight` (n,): of each draw.
    """

    z: NDArray[np.float64]
    log_prob: NDArray[np.float64]
    log_weight: NDArray[np.float64]

    @property
    def weight(self) -> NDArray[np.float64]:
        """Weights (n,), the greatest 1."""
        return np.exp(self.log_weight - self.log_weight.max())

    @property
    def even(self) -> float:
        """Share of effective draws, 1 where all weigh the same; 0 where none has a weight."""
        some = np.any(np.isfinite(self.log_weight))
        return kish(self.weight) / len(self.weight) if some else 0.0


def drawn(log_prob: LogProb, proposal: MixtureProposal, rng: Random, draws: int) -> Weighted:
    """Draw of a proposal and weigh for a posterior; where that is no number the weight is nothing.

    - log_prob: (n, d) -> (n,), unnormalised log posterior
    """
    z = proposal.sample(rng, draws)
    raw = np.asarray(log_prob(z), dtype=float)
    raw = np.where(np.isfinite(raw), raw, -np.inf)
    return Weighted(z, raw, raw - proposal.log_density(z))


def adapted(
    log_prob: LogProb, first: MixtureProposal, rng: Random, draws: int, dof: float
) -> MixtureProposal:
    """Fit a proposal to a posterior, from as many rounds of draws as it takes, ROUNDS at most.

    - log_prob: (n, d) -> (n,), unnormalised log posterior. - first: proposal around its modes.
    - draws: in each round. - dof: of the new proposal.

    Each draws of the proposal fitted to all draws before, weighted by the mixture of the proposals
    that they came from. Two rounds are enough where a fitted proposal has draws of even weights.
    Where none has, that whose draws had the most even ones is taken. What a round only fitted may
    lean on one draw that weighs much: it is not taken untried.

    Source: Cornuet et al. (2012), adaptive multiple importance sampling.
    """
    proposals, shares = [first], []
    z, raw = np.empty((0, first.dimension)), np.empty(0)
    for _ in range(ROUNDS):
        fresh = drawn(log_prob, proposals[-1], rng, draws)
        z = np.concatenate([z, fresh.z])
        raw = np.concatenate([raw, fresh.log_prob])
        mixed = np.logaddexp.reduce([proposal.log_density(z) for proposal in proposals], axis=0)
        shares.append(fresh.even)
        proposals.append(fitted(first, Weighted(z, raw, raw - mixed), dof))
        if len(shares) > 1 and shares[-1] >= EVEN:
            break
    return proposals[int(np.argmax(shares))]


def fitted(proposal: MixtureProposal, found: Weighted, dof: float) -> MixtureProposal:
    """Move and stretch a proposal, along the axes of which its draws say that they must be.

    - found: drawn from it. - dof: of the new proposal.

    The proposal around a best fit knows the curvature there only; along a bend of the posterior, as
    that of k_LC against k_frame, it can be half as wide as the posterior.
    """
    if not np.any(np.isfinite(found.log_weight)):
        return proposal
    shares = proposal.responsibilities(found.z) * found.weight[:, None]
    k = len(proposal.modes)
    laws = [_moved(law, found.z, s) for law, s in zip(proposal.laws, shares.T, strict=True)]
    weights = np.maximum(shares.sum(axis=0) / shares.sum(), LEAST_WEIGHT)
    if proposal.wider:
        weights[k:] = np.maximum(weights[k:], LEAST_FAR * weights[:k])
    return MixtureProposal(tuple(laws[:k]), weights, dof, tuple(laws[k:]))


def _moved(mode: Mode, z: NDArray[np.float64], weight: NDArray[np.float64]) -> Mode:
    """One law made to fit.

    In its own units the draws have the identity as covariance where it is right, and eigenvalues
    between (1 - sqrt(d/n))^2 and (1 + sqrt(d/n))^2 from chance alone (Marchenko and Pastur 1967),
    n effective draws: only axes beyond these are changed.
    """
    d = z.shape[1]
    if weight.sum() <= 0.0 or kish(weight) < d:
        return mode
    by_chance = np.sqrt(d / kish(weight))
    weight = weight / weight.sum()
    own = np.linalg.solve(mode.covariance_factor, (z - mode.mean).T).T
    centre = weight @ own
    covariance = (own * weight[:, None]).T @ own - np.outer(centre, centre)
    variance, axes = np.linalg.eigh(covariance)
    width = np.sqrt(np.maximum(variance, 0.0))
    width = np.where(abs(width - 1.0) <= by_chance, 1.0, width)
    factor = mode.covariance_factor @ (axes * width)
    mean = mode.mean + mode.covariance_factor @ centre
    stretched = np.asarray(np.linalg.cholesky(factor @ factor.T), dtype=np.float64)
    return Mode(mean, stretched, mode.log_posterior)
