"""What a chain is made of: blocks of steps, and the state of each ensemble after them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ChainShape:
    """What a chain must have in common with the run that goes on with it.

    - apart: whether every other ensemble begins away from the proposal
    """

    ensembles: int
    block: int
    walkers: int
    dimension: int
    seed: int
    apart: bool = True

    def begins_apart(self, index: int) -> bool:
        """Whether an ensemble begins away from the proposal.

        All ensembles would otherwise share what the proposal misses, and R-hat could not see it.
        Those apart begin between the proposal and the prior, and are led by the moves along other
        walkers alone for as many steps as a block has: what they then have found outside of the
        proposal they keep, since the independence move seldom leads away from there. Half a block
        of all moves brings those in that have found nothing, before any draw counts: some walkers
        under way, hundreds of standard deviations off, are not seen by the ranks that R-hat is made
        of.
        """
        return self.apart and index % 2 == 1


@dataclass(frozen=True, eq=False)
class EnsembleState:
    """All that decides how an ensemble goes on.

    - coords: (walkers, d); log_prob: (walkers,)
    - keys: (624,) uint32, position, has_gauss, cached: state of the Mersenne Twister
    """

    coords: NDArray[np.float64]
    log_prob: NDArray[np.float64]
    keys: NDArray[np.uint32]
    position: int
    has_gauss: int
    cached: float


@dataclass(frozen=True, eq=False)
class EnsembleBlock:
    """A block of steps of one ensemble and the state after it.

    - z: (steps, walkers, d); log_prob: (steps, walkers); accepted: (walkers,), steps that moved
    - evaluations, failed: points asked of the likelihood in this block, and those that failed
    """

    z: NDArray[np.float64]
    log_prob: NDArray[np.float64]
    accepted: NDArray[np.int64]
    evaluations: int
    failed: int
    state: EnsembleState


@dataclass(frozen=True, eq=False)
class Block:
    """A block of steps of all ensembles, and the seconds it took."""

    ensembles: tuple[EnsembleBlock, ...]
    seconds: float
