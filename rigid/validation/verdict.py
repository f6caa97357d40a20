"""What the rows of a validation say: every test, corrected for their number, and what to do."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rigid.inference.summary import Check
from rigid.validation.alarms import Alarms
from rigid.validation.coverage import LEVELS, Coverage, coverage, shown_from
from rigid.validation.design import Design
from rigid.validation.ecdf import p_value
from rigid.validation.ranks import LOG_POSTERIOR, TARP

ALPHA = 0.01
"""Probability with which a sound method is called none, over all tests together: half of it is for
the quantities, half for the posterior as a whole, whose few tests would be lost among theirs."""
FEWEST = 20
"""Replicates that a verdict takes."""
MOST_UNRELIABLE = 0.1
"""Share of replicates whose sums cannot be trusted from which on those that can say too little."""
JOINT = (LOG_POSTERIOR, TARP)
EVERY = "all"


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


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a validation found.

    - `design`. - `tested`: every quantity, the joint ones last. - `replicates`: used.
    - `unreliable`: fitted, but with sums that cannot be trusted; left out. - `failed`: not fitted.
    - `refused`: draws that the readers refused, over all replicates. - `cpu_s`: CPU time of all.
    - `alarms`: of discovery on the same campaigns; None where it was not asked.
    """

    design: Design
    tested: tuple[Tested, ...]
    replicates: int
    unreliable: int
    failed: int
    refused: int
    cpu_s: float
    alarms: Alarms | None = None

    @property
    def checks(self) -> tuple[Check, ...]:
        """What must hold for the method to be trusted on this spec."""
        heard = () if self.alarms is None else (self.alarms.check,)
        if self.replicates < 2:
            return (self._enough, *heard)
        return (self._enough, self._reliable, self._marginal, self._joint, *heard)

    @property
    def usable(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    @property
    def faults(self) -> tuple[Tested, ...]:
        """Quantities that fail, worst first."""
        return tuple(sorted((t for t in self.tested if not t.ok), key=lambda t: t.adjusted))

    @property
    def _enough(self) -> Check:
        n = self.replicates
        if n < FEWEST:
            says = f"{n} replicates say too little; run with --replicates 100 --resume"
            return Check("replicates", False, says)
        tests = 3 * sum(t.name not in JOINT for t in self.tested)
        least = shown_from(n, LEVELS[-1], 0.5 * ALPHA / tests)
        says = (
            f"{n} replicates: 90 % intervals that really hold {100 * least:.0f} % or less would be "
            "shown in 9 of 10 studies; more replicates show finer faults"
        )
        return Check("replicates", True, says)

    @property
    def _reliable(self) -> Check:
        done = self.replicates + self.unreliable + self.failed
        lost = self.unreliable + self.failed
        says = (
            f"{self.unreliable} of {done} replicates left out as unreliable, {self.failed} failed"
        )
        if lost <= MOST_UNRELIABLE * done:
            return Check("reliable", True, says)
        todo = "look at the rows" if self.design.full else "run with --full, which draws by chains"
        return Check("reliable", False, f"{says}; those that are left say too little: {todo}")

    @property
    def _marginal(self) -> Check:
        single = [t for t in self.tested if t.name not in JOINT]
        wrong = [t for t in self.faults if t.name not in JOINT]
        if not wrong:
            says = f"ranks and coverage of {len(single)} quantities are those of a sound posterior"
            return Check("quantities", True, says)
        worst = wrong[0]
        says = (
            f"{len(wrong)} of {len(single)} quantities fail, first {worst.name}: {worst.says} "
            f"(p = {worst.adjusted:.2g} for all tests together); do not quote their intervals from "
            "this spec"
        )
        return Check("quantities", False, says)

    @property
    def _joint(self) -> Check:
        both = [t for t in self.tested if t.name in JOINT]
        wrong = [t for t in both if not t.ok]
        if not wrong:
            found = ", ".join(f"{t.name} p = {t.p:.2g}" for t in both)
            return Check("joint", True, f"the posterior as a whole is sound ({found})")
        says = "; ".join(f"{t.name}: {_of_the_whole(t)}" for t in wrong)
        return Check("joint", False, f"{says}; do not use this spec's posterior as it stands")


def _of_the_whole(tested: Tested) -> str:
    """What a joint rank says where it fails."""
    found = tested.worst or Part(EVERY, tested.ranks, tested.p)
    mean = float(found.ranks.mean())
    way = "too narrow" if (mean < 0.5) == (tested.name == LOG_POSTERIOR) else "too wide or off"
    among = "" if found.name == EVERY else f"among the {len(found.ranks)} replicates {found.name} "
    return (
        f"{among}the posterior as a whole is {way} (mean rank {mean:.2f}, "
        f"p = {tested.adjusted:.2g})"
    )


def verdict(design: Design, rows: Sequence[Mapping[str, Any]]) -> Verdict:
    """Test the rows of a study.

    - `rows`: as `rigid.jobs.run.run` gives them.
    """
    done = [row["value"] for row in rows if row["failed"] is None]
    used = [value for value in done if value["good"]]
    names = list(dict.fromkeys(name for value in used for name in value["ranks"]))
    names = [n for n in names if n not in JOINT] + [n for n in JOINT if n in names]
    return Verdict(
        design=design,
        tested=_tested(names, used) if len(used) > 1 else (),
        replicates=len(used),
        unreliable=len(done) - len(used),
        failed=len(rows) - len(done),
        refused=sum(value["refused"] for value in done),
        cpu_s=sum(row["cost"]["cpu_s"] or 0.0 for row in rows),
    )


def _tested(names: Sequence[str], used: Sequence[Mapping[str, Any]]) -> tuple[Tested, ...]:
    found = [one for name in names if len((one := _uncorrected(name, used)).ranks) > 1]
    single = [t for t in found if t.name not in JOINT]
    tests = [[t.p, *(c.p for c in t.coverage)] for t in single]
    corrected = (
        holm(np.array(tests).ravel()).reshape(len(single), -1) if single else np.empty((0, 1))
    )
    told = [
        _shared(t, float(least)) for t, least in zip(single, corrected.min(axis=1), strict=True)
    ]
    joint = [(t, _parts(t.name, used)) for t in found if t.name in JOINT]
    left = iter(holm(np.array([part.p for _, parts in joint for part in parts])).tolist())
    for one, parts in joint:
        least, worst = min(((next(left), part) for part in parts), key=lambda pair: pair[0])
        told.append(dataclasses.replace(_shared(one, least), worst=worst))
    return tuple(told)


def _shared(tested: Tested, least: float) -> Tested:
    """Put in the least probability of a quantity, of the two kinds of tests."""
    return dataclasses.replace(tested, adjusted=min(2.0 * least, 1.0))


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


def _parts(name: str, used: Sequence[Mapping[str, Any]]) -> list[Part]:
    """All replicates, then those summed by weighted draws and by chains, each for itself.

    The hard campaigns fall to chains; what these miss is lost among the others.
    """
    weights = [v for v in used if v["pareto_k"] is not None]
    chains = [v for v in used if v["pareto_k"] is None]
    parts = [(EVERY, used)]
    if weights and chains:
        parts += [("by weights", weights), ("by chain", chains)]
    listed = [(label, _ranks(name, some)) for label, some in parts]
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
