"""What every hidden cause has in common: a name, an equation, an amplitude, where it acts."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import ClassVar

import numpy as np

from rigid.generator.core import Piece, Rig, Run

SLOW = ("frame", "free-run", "field")
ALL = (*SLOW, "release")
FROM_RIG = {"k_LC", "column", "modulus", "stiffness"}
"""Fields that a piece takes from the rig it is put into; no numbers of the cause."""


@dataclass(frozen=True)
class Hidden(Piece):
    """A cause that no spec names; its form is not that of the catalogue where another will do.

    - amplitude: 0 or more; at 0 it is not there. A cause of either sign keeps that in a field

    Class variables: `name`; `equation` it enters, in the words of the interface; `law` as a
    formula; `typical` amplitude, at which its strength is about 8; `kinds` of records in which it
    acts.
    """

    amplitude: float

    name: ClassVar[str]
    equation: ClassVar[str]
    law: ClassVar[str]
    typical: ClassVar[float]
    kinds: ClassVar[tuple[str, ...]] = ALL

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> "Hidden":  # noqa: ARG003
        """Draw the numbers beside the amplitude, which is the typical one."""
        return cls(cls.typical)

    def of(self, amplitude: float) -> "Hidden":
        """Give the same cause at another amplitude."""
        return replace(self, amplitude=amplitude)

    def parameters(self) -> dict:
        """All its numbers, SI, but those of the rig."""
        return {name: value for name, value in asdict(self).items() if name not in FROM_RIG}

    def acts(self, run: Run) -> bool:
        """Whether the run knows of it."""
        return self.amplitude != 0.0 and run.kind in self.kinds

    def within(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Give what acts in a run: nothing at amplitude 0 and in records of other kinds."""
        return self.pieces(rig, run) if self.acts(run) else ()

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:  # noqa: ARG002
        """Give what acts in a run that knows of it; by default the cause is its own piece."""
        return (self,)


def spread(rng: np.random.Generator, median: float, factor: float = 1.3) -> float:
    """Draw from a lognormal law; two thirds lie within the factor."""
    return float(median * np.exp(np.log(factor) * rng.standard_normal()))


def either(rng: np.random.Generator) -> int:
    """Draw a sign."""
    return 1 if rng.uniform() < 0.5 else -1
