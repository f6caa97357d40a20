"""How walkers move: draws from the mixture over the modes, and two moves along other walkers."""

from collections.abc import Callable
from typing import Any

import emcee
import numpy as np
from emcee.moves import DEMove, Move, RedBlueMove
from numpy.typing import NDArray

from rigid.inference.proposal import LogProb, MixtureProposal

# Share of the steps of each move. Most of them jump between modes and forget the past whenever the
# mixture fits; the others need no fit at all and carry the walkers along a curved ridge that
# the mixture misses. The snooker has the smallest part: it moves along one line at a time.
INDEPENDENCE, EVOLUTION, SNOOKER = 0.8, 0.15, 0.05


class IndependenceMove(Move):
    """Propose for every walker at once a point of the mixture, wherever the walker is.

    Accepted with probability min(1, p(z') g(z) / (p(z) g(z'))), p the posterior, g the mixture.

    Source: Tierney (1994), "Markov chains for exploring posterior distributions", section 2.3.3.
    """

    def __init__(self, proposal: MixtureProposal) -> None:
        self.proposal = proposal

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, NDArray[np.bool_]]:
        """Advance the ensemble by one step; returns the new state and who moved, (walkers,)."""
        n = len(state.coords)
        coords = self.proposal.sample(model.random, n)
        log_prob, _ = model.compute_log_prob_fn(coords)
        difference = log_prob - state.log_prob + self.factors(state.coords, coords)
        with np.errstate(divide="ignore"):
            accepted = np.log(model.random.random_sample(n)) < difference
        new = emcee.State(coords, log_prob=log_prob)
        return self.update(state, new, accepted), accepted

    def factors(self, old: NDArray[np.float64], new: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log of the ratio of proposal densities q(old | new) / q(new | old), (walkers,)."""
        return self.proposal.log_density(old) - self.proposal.log_density(new)


class SnookerMove(RedBlueMove):
    """Move each walker along the line through another one, by the projected difference of two more.

    It stands in for emcee.moves.DESnookerMove, which in emcee 3.1.6 (the last release) draws from
    a wrong law: it divides by the square root of the distance where the distance belongs, and
    takes half of the Hastings factor (emcee pull request 531, merged, not released). On a Gaussian
    of five dimensions its variance comes out 31 % too small.

    Source: ter Braak and Vrugt (2008), "Differential Evolution Markov Chain with snooker updater
    and fewer chains", eqs. (3)-(5); gamma = 1.7 is the middle of their U(1.2, 2.2).
    """

    gamma = 1.7

    def get_proposal(
        self, sample: NDArray[np.float64], complement: list[NDArray[np.float64]], random: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Propose for `sample` (n, d), the other half standing still; points and log factors."""
        others = np.concatenate(complement)
        picks = np.argsort(random.random_sample((len(sample), len(others))), axis=1)[:, :3]
        anchor, first, second = (others[picks[:, i]] for i in range(3))
        line = sample - anchor
        distance = np.linalg.norm(line, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            line = line / distance[:, None]
            step = self.gamma * np.sum(line * (first - second), axis=1)
            new = sample + step[:, None] * line
            factors = (sample.shape[1] - 1) * np.log(np.abs(distance + step) / distance)
        on_anchor = ~np.isfinite(factors)  # a walker on its anchor has no line: it stays
        return np.where(on_anchor[:, None], sample, new), np.where(on_anchor, -np.inf, factors)


def mixed(proposal: MixtureProposal) -> list[tuple[Move, float]]:
    """The moves of one ensemble and their shares, made anew for each thread."""
    return [(IndependenceMove(proposal), INDEPENDENCE), *along_others()]


def along_others() -> list[tuple[Move, float]]:
    """The moves that know nothing of the mixture."""
    return [(DEMove(), EVOLUTION), (SnookerMove(), SNOOKER)]


class Padded:
    """A log-probability that always sees one batch shape; see `padded`.

    - evaluations: points asked for so far (what fills up a batch is not counted)
    - failed: of these, how many gave NaN or plus infinity
    """

    def __init__(self, log_prob: LogProb, batch: int) -> None:
        self.log_prob = log_prob
        self.batch = batch
        self.evaluations = 0
        self.failed = 0

    def __call__(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log probability of z (n, d) for any n, (n,); what is not a number becomes -inf."""
        parts = [self._one(z[i : i + self.batch]) for i in range(0, len(z), self.batch)]
        values = np.concatenate(parts) if parts else np.empty(0)
        bad = np.isnan(values) | (values == np.inf)
        self.evaluations += len(values)
        self.failed += int(np.sum(bad))
        return np.where(bad, -np.inf, values)

    def _one(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        n = len(z)
        if n < self.batch:
            z = np.concatenate([z, np.repeat(z[-1:], self.batch - n, axis=0)])
        return np.array(self.log_prob(z), dtype=float)[:n]


def padded(log_prob: Callable[..., Any], batch: int) -> Padded:
    """Wrap `log_prob` so that it always receives (batch, d).

    XLA compiles one program per shape, and the last bits of a result differ between shapes. Fewer
    rows are filled up with the last one, more are cut into batches.
    """
    return Padded(log_prob, batch)
