"""What a chain is made of: blocks of steps, and the state of each ensemble after them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ChainShape:
    """What a chain must have in common with the run that goes on with it."""

    ensembles: int
    block: int
    walkers: int
    dimension: int
    seed: int


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
