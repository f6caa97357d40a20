"""What every hidden cause has in common: a name, an equation, an amplitude, where it acts."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, ClassVar, TypeVar

import numpy as np

from rigid.generator.core import Piece, Rig, Run, Seen

SLOW = ("frame", "free-run", "field")
ALL = (*SLOW, "release")


@dataclass(frozen=True)
class Hidden(Piece):
    """A cause that no spec names; its form is not that of the catalogue where another will do.

    - amplitude: 0 or more; at 0 it is not there. A cause of either sign keeps that in a field

    A field says how it is drawn (`drawn_by`, `spread`, `uniform`, `either`), or that the rig has
    it (`of_rig`). What `cause` sets: `name`; `equation` it enters, in the words of the interface;
    `law` as a formula; `typical` amplitude, at which its strength is about 8; `kinds` of records
    in which it acts. `channel` is what it distorts, by `error`.
    """

    amplitude: float

    name: ClassVar[str]
    equation: ClassVar[str]
    law: ClassVar[str]
    typical: ClassVar[float]
    kinds: ClassVar[tuple[str, ...]]
    channel: ClassVar[str] = ""

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> "Hidden":
        """Draw the numbers beside the amplitude, which is the typical one."""
        draws = {f.name: f.metadata["draw"] for f in fields(cls) if "draw" in f.metadata}
        return cls(cls.typical, **{name: draw(rng) for name, draw in draws.items()})

    def of(self, amplitude: float) -> "Hidden":
        """Give the same cause at another amplitude."""
        return replace(self, amplitude=amplitude)

    def parameters(self) -> dict:
        """All its numbers, SI, but those of the rig."""
        own = {one.name for one in fields(self) if "rig" not in one.metadata}
        return {name: value for name, value in asdict(self).items() if name in own}

    def acts(self, run: Run) -> bool:
        """Whether the run knows of it."""
        return self.amplitude != 0.0 and run.kind in self.kinds

    def within(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Give what acts in a run: nothing at amplitude 0 and in records of other kinds."""
        return self.pieces(rig, run) if self.acts(run) else ()

    def pieces(self, rig: Rig, run: Run) -> tuple[Piece, ...]:
        """Give what acts in a run that knows of it: the cause itself, with the rig's numbers."""
        taken = {f.name: f.metadata["rig"] for f in fields(self) if "rig" in f.metadata}
        return (replace(self, **{name: getattr(rig, whose) for name, whose in taken.items()}),)

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Add the error to the channel that it is of."""
        if not self.channel:
            return readings
        return readings | {self.channel: readings[self.channel] + self.error(seen)}

    def error(self, seen: Seen) -> np.ndarray:
        """What the channel reads too much, SI."""
        raise NotImplementedError


@dataclass(frozen=True)
class InOneRecord(Hidden):
    """A cause that one slow record alone knows of."""

    sign: int = 1
    record: str = ""
    cylinder: str = ""

    @classmethod
    def drawn(cls, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:
        """Draw the record, when in it, and the sign."""
        slow = [run for run in runs if run.kind in {"frame", "free-run"}]
        run = slow[int(rng.integers(len(slow)))]
        times = cls.times(rng, run)
        return cls(cls.typical, _sign(rng), run.name, run.cylinder, *times)

    @classmethod
    def times(cls, rng: np.random.Generator, run: Run) -> tuple[float, ...]:
        """Draw the fields after `cylinder`: times [s] in the record."""
        raise NotImplementedError

    def acts(self, run: Run) -> bool:
        """Whether it is the one record."""
        return super().acts(run) and (run.name, run.cylinder) == (self.record, self.cylinder)


Cause = TypeVar("Cause", bound=Hidden)


def cause(
    name: str, equation: str, typical: float, law: str, kinds: tuple[str, ...] = ALL
) -> Callable[[type[Cause]], type[Cause]]:
    """Name a cause: what `Hidden` says of its class variables."""

    def named(one: type[Cause]) -> type[Cause]:
        one.name, one.equation, one.typical, one.law, one.kinds = (
            name,
            equation,
            typical,
            law,
            kinds,
        )
        return one

    return named


def drawn_by(draw: Callable[[np.random.Generator], Any], usual: Any) -> Any:
    """Make a field that is drawn; `usual` where none is given."""
    return field(default=usual, metadata={"draw": draw})


def spread(median: float, factor: float = 1.3) -> Any:
    """Make a field of a lognormal law; two thirds lie within the factor."""
    return drawn_by(
        lambda rng: float(median * np.exp(np.log(factor) * rng.standard_normal())), median
    )


def uniform(low: float, high: float) -> Any:
    """Make a field between two bounds."""
    return drawn_by(lambda rng: float(rng.uniform(low, high)), (low + high) / 2)


def either() -> Any:
    """Make a field that is a sign."""
    return drawn_by(_sign, 1)


def _sign(rng: np.random.Generator) -> int:
    return 1 if rng.uniform() < 0.5 else -1


def of_rig(whose: str) -> Any:
    """Make a field that is the rig's number of this name, and none of the cause's own."""
    return field(default=float("nan"), metadata={"rig": whose})
