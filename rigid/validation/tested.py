"""Every test of a validation's rows, corrected for their number."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

from rigid.validation.coverage import LEVELS, Coverage, Held, coverage, held
from rigid.validation.draws import BY
from rigid.validation.ecdf import p_value
from rigid.validation.ranks import LOG_POSTERIOR, TARP, WEIGHT
from rigid.validation.score import SCORE

ALPHA = 0.01
"""Probability with which a sound method is called none, over all tests together: half of it is for
the quantities, half for the posterior as a whole, whose few tests would be lost among theirs."""
SELDOM = 0.02
"""Share of campaigns in which a search may miss the better optimum, or the solver err."""
JOINT = (LOG_POSTERIOR, TARP, WEIGHT, SCORE)
EVERY = "all"


def seldom(many: int, campaigns: int) -> bool:
    """Whether so many campaigns are no more than SELDOM of them, chance allowed for."""
    return bool(binomtest(many, campaigns, SELDOM, alternative="greater").pvalue >= ALPHA)


class Part(NamedTuple):
    """Ranks (n,) of some of the replicates, and the probability that they are uniform."""

    name: str
    ranks: np.ndarray
    p: float


@dataclass(frozen=True, eq=False)
class Tested:
    """One quantity over all replicates.

    - `ranks` (n,). - `p`: that its ranks are uniform. - `coverage`: of each level.
    - `adjusted`: least probability of its tests, corrected for the number of all tests (Holm) and
      the share of ALPHA that they have.
    - `gained`: median over replicates of 1 - posterior sd / prior sd; None for what has no prior of
      its own.
    - `worst`: of a joint rank, the replicates that fit it least: all, or those summed in one way.
    """

    name: str
    ranks: np.ndarray
    p: float
    coverage: tuple[Coverage, ...]
    adjusted: float
    gained: float | None
    worst: Part | None = None

    @property
    def ok(self) -> bool:
        """Whether no test of it fails."""
        return self.adjusted >= ALPHA

    @property
    def says(self) -> str:
        """What is wrong with it, in words; empty where nothing is."""
        if self.ok:
            return ""
        mean, wide = float(self.ranks.mean()), self.coverage[-1]
        side = (mean - 0.5) * np.sqrt(12.0 * len(self.ranks))
        if abs(side) > 3.0:
            way = "small" if side > 0.0 else "large"
            return (
                f"estimates are too {way}: the truth lies at {mean:.2f} of the posterior, not 0.5"
            )
        if wide.share < wide.level:
            return (
                f"intervals are too narrow: {100 * wide.level:.0f} % intervals hold "
                f"{100 * wide.share:.0f} %"
            )
        return (
            f"intervals are too wide: {100 * wide.level:.0f} % intervals hold "
            f"{100 * wide.share:.0f} %"
        )


def tests(
    single: Sequence[str], joint: Sequence[str], used: Sequence[Mapping[str, Any]]
) -> tuple[tuple[Tested, ...], tuple[Held, ...]]:
    """Test quantities and the posterior as a whole, each kind corrected for its number of tests."""
    found = [one for name in single if len((one := _uncorrected(name, used)).ranks) > 1]
    tests = [[t.p, *(c.p for c in t.coverage)] for t in found]
    corrected = holm(np.array(tests).ravel()).reshape(len(found), -1) if found else np.empty((0, 1))
    told = [
        dataclasses.replace(t, adjusted=_shared(float(least)))
        for t, least in zip(found, corrected.min(axis=1), strict=True)
    ]
    parted = _parts(used)
    shares = [held(*part, single, LEVELS[-1]) for part in parted if single]
    together = [one for one in shares if one is not None]
    whole = [(_uncorrected(name, used), _ranked(name, parted)) for name in joint]
    raw = [part.p for _, parts in whole for part in parts] + [one.p for one in together]
    left = iter(holm(np.array(raw)).tolist())
    for one, parts in whole:
        least, worst = min(((next(left), part) for part in parts), key=lambda pair: pair[0])
        told.append(dataclasses.replace(one, adjusted=_shared(least), worst=worst))
    return tuple(told), tuple(
        dataclasses.replace(one, adjusted=_shared(p)) for one, p in zip(together, left, strict=True)
    )


def _shared(least: float) -> float:
    """The probability of a test among those of both kinds."""
    return min(2.0 * least, 1.0)


def _uncorrected(name: str, used: Sequence[Mapping[str, Any]]) -> Tested:
    ranks = _ranks(name, used)
    widths = [v["width"][name] for v in used if name in v["width"]]
    gained = 1.0 - float(np.median(widths)) if widths else None
    shares = tuple(coverage(ranks, level) for level in LEVELS)
    return Tested(name, ranks, _uniform(ranks), shares, 1.0, gained)


def _ranks(name: str, used: Sequence[Mapping[str, Any]]) -> np.ndarray:
    return np.array([v["ranks"][name] for v in used if name in v["ranks"]])


def _uniform(ranks: np.ndarray) -> float:
    return p_value(ranks) if len(ranks) > 1 else 1.0


def _parts(used: Sequence[Mapping[str, Any]]) -> list[tuple[str, Sequence[Mapping[str, Any]]]]:
    """All replicates, then those drawn in one way, each for itself.

    What the ways for hard campaigns miss is lost among the others.
    """
    ways = [(way, [v for v in used if v["by"] == way]) for way in BY]
    some = [(f"by {way}", values) for way, values in ways if values]
    return [(EVERY, used), *(some if len(some) > 1 else [])]


def _ranked(name: str, parted: list[tuple[str, Sequence[Mapping[str, Any]]]]) -> list[Part]:
    """Ranks of a joint quantity among some of the replicates; a score has no part in the sums."""
    some = parted[:1] if name == SCORE else parted
    listed = [(label, _ranks(name, values)) for label, values in some]
    return [Part(label, ranks, _uniform(ranks)) for label, ranks in listed]


def holm(p: np.ndarray) -> np.ndarray:
    """Probabilities (n,) corrected for their number.

    Source: Holm (1979), Scandinavian Journal of Statistics 6.
    """
    order = np.argsort(p)
    stepped = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    out = np.empty(len(p))
    out[order] = np.minimum(stepped, 1.0)
    return out
