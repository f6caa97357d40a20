"""What every sort of hidden thing says of itself; each sort is one class in one file here."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.formula import simplest
from rigid.localfit.hidden_inputs import TIME, Abscissa
from rigid.localfit.local import LocalFit
from rigid.plots.shown import HiddenShown


class About(NamedTuple):
    """What a hidden thing is.

    - `equation`: in which it stands, "sensor" for a distortion. - `name`: in words, "hidden flow
      into the chamber". - `unit`: of its size. - `over`: what it goes by.
    """

    equation: str
    name: str
    unit: str
    over: Abscissa


@dataclasses.dataclass(frozen=True)
class AbstractHidden(ABC):
    """One hidden thing; its fields tell it from others of its sort.

    A class in a file of this folder is a sort that every discovery weighs. Fields are text,
    numbers, tuples of these and other hidden things.

    - `sort`: its name. - `order`: place among the sorts, each of which sees the signatures of those
      before it.
    - `log_share`: log of the share of its prior that it stands for, where it is the best of so many
      `tried`.
    """

    log_share: float = dataclasses.field(default=0.0, kw_only=True)
    tried: int = dataclasses.field(default=1, kw_only=True)

    sort: ClassVar[str]
    order: ClassVar[int] = 100

    @classmethod
    @abstractmethod
    def signatures(cls, fit: Fitted, earlier: "Callable[[], Bumps]") -> "Bumps":
        """Return what all of the sort would leave in the records of a fit.

        - `earlier`: gives those of the sorts before, all in one piece: a copy of hundreds of MB.

        A hidden thing that is not there leaves nothing, and twice as much of it leaves twice as
        much.
        """

    @property
    @abstractmethod
    def about(self) -> About:
        """What it is."""

    @property
    def prior_class(self) -> str:
        """Whose share of the prior it takes part in; all classes have the same."""
        return self.sort

    @property
    def pooled(self) -> "AbstractHidden | None":
        """The same in all records together; None where it is not one record's alone."""
        return None

    @property
    def timed(self) -> bool:
        """Whether slow noise looks the same: by the time of one record, all along it."""
        return False

    @property
    def wanders(self) -> bool:
        """Whether it does so in one sensor alone."""
        return False

    @property
    def forms(self) -> tuple[str, ...]:
        """Simple shapes over what it goes by in which it is weighed as well; see `straight`."""
        return ()

    def shown(self, found: "Inferred") -> HiddenShown:
        """What the page shows of it: here a curve over the centres, with a formula if one fits."""
        formula = simplest(found.own.centre, found.mean, found.covariance, self.about.over.symbol)
        order = np.argsort(found.own.centre, kind="stable")
        place, mean, sd = (one[order] for one in (found.own.centre, found.mean, found.sd))
        if formula is None:
            return self.drawn(place, mean, sd, None, "")
        return self.drawn(place, mean, sd, formula.values[order], formula.words)

    def drawn(
        self,
        place: Float[np.ndarray, " n"],
        mean: Float[np.ndarray, " n"],
        sd: Float[np.ndarray, " n"],
        formula: Float[np.ndarray, " n"] | None,
        words: str,
    ) -> HiddenShown:
        """A curve in its units, over what it goes by."""
        over, about = self.about.over, self.about
        return HiddenShown(
            over.name, over.unit, about.name, about.unit, place, mean, sd, formula, words
        )


@dataclasses.dataclass(frozen=True)
class Curve(AbstractHidden):
    """A hidden thing that goes by time, or by something that the records tell.

    - `kind`: which of its sort. - `variable`: name of what it goes by. - `track`: one record's
      alone.
    """

    kind: str
    variable: str
    track: str | None = None

    @property
    def prior_class(self) -> str:
        """Curves over time and others have a share each."""
        return "time" if self.variable == TIME.name else "curve"

    @property
    def timed(self) -> bool:
        """Over the time of one record."""
        return self.variable == TIME.name and self.track is not None

    @property
    def pooled(self) -> AbstractHidden | None:
        """The same over the time of all records."""
        return None if self.track is None else dataclasses.replace(self, track=None)


@dataclasses.dataclass(frozen=True)
class Bumps:
    """Signatures of hidden things.

    - `columns`: change of every sample by a unit of each. - `target`: whose it is; those of one
      hidden thing are weighed together. - `centre`: where it has its place in what that goes by, or
      its number.
    """

    columns: Float[np.ndarray, "n m"]
    target: tuple[AbstractHidden, ...]
    centre: Float[np.ndarray, " m"]

    def of(self, mine: Bool[np.ndarray, " m"] | np.ndarray) -> "Bumps":
        """Return some of them, by mask or numbers."""
        listed = tuple(self.target[i] for i in np.arange(len(self.target))[mine])
        return Bumps(self.columns[:, mine], listed, self.centre[mine])


def none(samples: int) -> Bumps:
    """Signatures of nothing."""
    return Bumps(np.zeros((samples, 0)), (), np.zeros(0))


def together(parts: Sequence[Bumps]) -> Bumps:
    """Put signatures side by side."""
    return Bumps(
        np.concatenate([p.columns for p in parts], axis=1),
        tuple(t for p in parts for t in p.target),
        np.concatenate([p.centre for p in parts]),
    )


@dataclasses.dataclass(frozen=True)
class Inferred:
    """What the records say of one hidden thing.

    - `hidden`. - `mean`, `covariance`: of its numbers, one for each of its `own` signatures.
    - `local`: the fit. - `everything`: signatures of all that is hidden.
    """

    hidden: AbstractHidden
    mean: Float[np.ndarray, " m"]
    covariance: Float[np.ndarray, "m m"]
    own: Bumps
    local: LocalFit
    everything: Bumps

    @property
    def sd(self) -> Float[np.ndarray, " m"]:
        """Standard deviation of each number."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def shown(self) -> HiddenShown:
        """What the page shows of it."""
        return self.hidden.shown(self)
