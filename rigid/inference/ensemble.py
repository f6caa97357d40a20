"""One ensemble of walkers: how it begins, and how a block of steps is added to it."""

import threading
from dataclasses import dataclass, field
from typing import Any

import emcee
import numpy as np
from numpy.typing import NDArray

from rigid.inference import moves
from rigid.inference.chain import ChainShape, EnsembleBlock, EnsembleState
from rigid.inference.proposal import LogProb, MixtureProposal
from rigid.io.errors import UnusableResultError

# Attempts to find a start with a finite posterior: enough where one draw in ten has one (of a
# hundred thousand walkers, three fail), and soon over where none has.
REDRAWS = 100
# Of a block: steps of all moves that bring those in that began apart, before draws count.
SETTLING = 0.5


class Abandoned(Exception):
    """The block was given up: another ensemble failed, or the user asked to stop."""


@dataclass(frozen=True, eq=False)
class Ensemble:
    """How ensembles begin and go on. It holds no state of theirs, so that threads share nothing.

    - log_prob: (walkers // 2, d) -> (walkers // 2,). Half of the walkers at once: the moves along
      other walkers ask for one half and then the other, the independence move for both, and so
      nothing is evaluated in vain
    - stop: set it, and blocks under way end with `Abandoned` at their next likelihood
    """

    log_prob: LogProb
    proposal: MixtureProposal
    layout: ChainShape
    stop: threading.Event = field(default_factory=threading.Event)

    def block(self, index: int, before: EnsembleState | None) -> EnsembleBlock:
        """Advance ensemble number `index` by a block, or begin it if there is no state before.

        One that begins apart makes more steps in its first block, of which the last are told.

        Walkers that never moved in the first block, which is dropped anyway, begin again
        elsewhere for the second.

        Raises UnusableResultError when no start with a finite posterior is found.
        """
        counted = moves.padded(self._stoppable, self.layout.walkers // 2)
        state = before or self._begin(index, counted)
        steps, led = self.layout.block, before is None and self.layout.begins_apart(index)
        start = emcee.State(state.coords, log_prob=state.log_prob, random_state=_words(state))
        runs = []
        for mix, count in (
            (moves.along_others(), steps if led else 0),
            (moves.mixed(self.proposal), round(SETTLING * steps) if led else steps),
        ):
            run = self._sampler(counted, mix)
            for last in run.sample(start, iterations=count, skip_initial_state_check=True):
                start = last
            runs += [run] if count else []
        accepted = np.sum([one.backend.accepted for one in runs], axis=0).astype(np.int64)
        coords, log_prob = np.array(start.coords), np.array(start.log_prob)
        random = np.random.RandomState()
        random.set_state(runs[-1].random_state)
        stuck = np.flatnonzero(accepted == 0)
        if before is None and len(stuck):
            coords[stuck], log_prob[stuck] = self._starts(
                random, self.proposal.sample(random, len(stuck)), counted
            )
        return EnsembleBlock(
            z=np.concatenate([one.backend.chain for one in runs])[-steps:],
            log_prob=np.concatenate([one.backend.log_prob for one in runs])[-steps:],
            accepted=accepted,
            evaluations=counted.evaluations,
            failed=counted.failed,
            state=_state(coords, log_prob, random),
        )

    def _sampler(self, counted: moves.Padded, mix: list) -> emcee.EnsembleSampler:
        d, n = self.proposal.dimension, self.layout.walkers
        run: Any = emcee.EnsembleSampler(n, d, counted, moves=mix, vectorize=True)
        run.log_prob_fn = counted  # emcee's own wrapper prints to standard output when it fails
        return run

    def _stoppable(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.stop.is_set():
            raise Abandoned
        return self.log_prob(z)

    def _begin(self, index: int, counted: moves.Padded) -> EnsembleState:
        seeds = np.random.SeedSequence(self.layout.seed).spawn(self.layout.ensembles)
        random = np.random.RandomState(np.random.MT19937(seeds[index]))
        apart = self.layout.begins_apart(index)
        draw = self.proposal.sample_apart if apart else self.proposal.sample
        return _state(*self._starts(random, draw(random, self.layout.walkers), counted), random)

    def _starts(
        self, random: np.random.RandomState, z: NDArray[np.float64], counted: moves.Padded
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points (n, d) with a finite posterior, and their log-probabilities.

        - z: (n, d), tried first; where the posterior has no value, points of the proposal are.
        """
        n, values = len(z), counted(z)
        for _ in range(REDRAWS):
            bad = np.flatnonzero(~np.isfinite(values))
            if not len(bad):
                return z, values
            z[bad] = self.proposal.sample(random, len(bad))
            values[bad] = counted(z[bad])
        raise UnusableResultError(
            f"{n} walkers looked for a place with a finite posterior around the best fit; after "
            f"{REDRAWS} draws each, {np.sum(~np.isfinite(values))} had none: the model fails there"
        )


def _state(
    coords: NDArray[np.float64], log_prob: NDArray[np.float64], random: np.random.RandomState
) -> EnsembleState:
    words: Any = random.get_state(legacy=False)
    inner = words["state"]
    return EnsembleState(
        coords=coords,
        log_prob=log_prob,
        keys=np.array(inner["key"], dtype=np.uint32),
        position=int(inner["pos"]),
        has_gauss=int(words["has_gauss"]),
        cached=float(words["gauss"]),
    )


def _words(state: EnsembleState) -> tuple[str, NDArray[np.uint32], int, int, float]:
    return ("MT19937", state.keys, state.position, state.has_gauss, state.cached)
