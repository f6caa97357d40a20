"""What the rows of a validation say: every test, corrected for their number, and what to do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.inference.summary import Check
from rigid.validation.alarms import Alarms
from rigid.validation.coverage import LEVELS, Coverage, coverage, shown_from
from rigid.validation.design import Design
from rigid.validation.ecdf import p_value
from rigid.validation.ranks import LOG_POSTERIOR, TARP

ALPHA = 0.01
"""Probability with which a sound method is called none, over all tests together."""
FEWEST = 20
"""Replicates that a verdict takes."""
MOST_UNRELIABLE = 0.1
"""Share of replicates whose sums cannot be trusted from which on those that can say too little."""
JOINT = (LOG_POSTERIOR, TARP)


@dataclass(frozen=True, eq=False)
class Tested:
    """One quantity over all replicates.

    - `ranks` (n,). - `p`: that its ranks are uniform. - `coverage`: of each level.
    - `adjusted`: least probability of its tests, corrected for the number of all tests (Holm).
    - `gained`: median over replicates of 1 - posterior sd / prior sd; None for what has no prior of
      its own.
    """

    name: str
    ranks: np.ndarray
    p: float
    coverage: tuple[Coverage, ...]
    adjusted: float
    gained: float | None

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
        tests = 3 * len(self.tested)
        least = shown_from(n, LEVELS[-1], ALPHA / tests)
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
    mean = float(tested.ranks.mean())
    way = "too narrow" if (mean < 0.5) == (tested.name == LOG_POSTERIOR) else "too wide or off"
    return f"the posterior as a whole is {way} (mean rank {mean:.2f}, p = {tested.adjusted:.2g})"


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
    found = []
    for name in names:
        ranks = np.array([v["ranks"][name] for v in used if name in v["ranks"]])
        if len(ranks) < 2:
            continue
        widths = [v["width"][name] for v in used if name in v["width"]]
        gained = 1.0 - float(np.median(widths)) if widths else None
        shares = tuple(coverage(ranks, level) for level in LEVELS)
        found.append((name, ranks, p_value(ranks), shares, gained))
    single = [[p, *(c.p for c in shares)] for _, _, p, shares, _ in found]
    corrected = holm(np.array(single).ravel()).reshape(len(found), -1)
    return tuple(
        Tested(name, ranks, p, shares, float(least), gained)
        for (name, ranks, p, shares, gained), least in zip(
            found, corrected.min(axis=1), strict=True
        )
    )


def holm(p: np.ndarray) -> np.ndarray:
    """Probabilities (n,) corrected for their number.

    Source: Holm (1979), Scandinavian Journal of Statistics 6.
    """
    order = np.argsort(p)
    stepped = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    out = np.empty(len(p))
    out[order] = np.minimum(stepped, 1.0)
    return out
