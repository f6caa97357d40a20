"""What the rows of a validation say, and what to do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rigid.inference.summary import Check
from rigid.validation.alarms import Alarms
from rigid.validation.coverage import LEVELS, Held, shown_from
from rigid.validation.design import FULL, SLOPES, Design
from rigid.validation.missed import seldom_missed
from rigid.validation.ranks import LOG_POSTERIOR, TARP, WEIGHT
from rigid.validation.score import SCORE, Slopes, slopes
from rigid.validation.solved import seldom_off
from rigid.validation.tested import ALPHA, EVERY, JOINT, Part, Tested, tests

FEWEST = 20
"""Replicates that a verdict takes."""
ENOUGH = "replicates"
"""Name of the check of their number."""
MOST_UNRELIABLE = 0.1
"""Share of replicates whose sums cannot be trusted from which on those that can say too little."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a validation found.

    - `design`. - `tested`: every quantity, the joint ones last. - `held`: by intervals of all
      quantities together, of all replicates and of those drawn in one way. - `replicates`: used.
    - `unreliable`: fitted, but with sums that cannot be trusted; left out. - `failed`: not fitted.
    - `slopes`: at the truths; None for rows without any. - `searched`: whether searches find the
      best optimum; None where nothing was fitted. - `solver`: whether steps are diffrax's at the
      truths; None where nothing was fitted, or nothing is solved.
    - `refused`: draws that the readers refused, over all replicates. - `cpu_s`: CPU time of all.
    - `alarms`: of discovery on the same campaigns; None where it was not asked.
    """

    design: Design
    tested: tuple[Tested, ...]
    held: tuple[Held, ...]
    slopes: Slopes | None
    searched: Check | None
    solver: Check | None
    replicates: int
    unreliable: int
    failed: int
    refused: int
    cpu_s: float
    alarms: Alarms | None = None

    @property
    def checks(self) -> tuple[Check, ...]:
        """What must hold for the method to be trusted on this spec."""
        alarms = () if self.alarms is None else (self.alarms.check,)
        if self.replicates < 2:
            return (self._enough, *alarms)
        if self.design.fit == SLOPES:
            return (self._enough, self._alone)
        together = (self._together,) if self.held else ()
        apart = (one for one in (self.searched, self.solver) if one is not None)
        both = (self._marginal, self._joint, *together)
        return (self._enough, self._reliable, *apart, *both, *alarms)

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
            return Check(ENOUGH, False, says)
        if self.design.fit == SLOPES:
            return Check(ENOUGH, True, f"{n} replicates, of which none was fitted")
        tests = 3 * sum(t.name not in JOINT for t in self.tested)
        least = shown_from(n, LEVELS[-1], 0.5 * ALPHA / tests)
        says = (
            f"{n} replicates: 90 % intervals that really hold {100 * least:.0f} % or less would be "
            "shown in 9 of 10 studies; more replicates show finer faults"
        )
        return Check(ENOUGH, True, says)

    @property
    def _reliable(self) -> Check:
        done = self.replicates + self.unreliable + self.failed
        lost = self.unreliable + self.failed
        says = (
            f"{self.unreliable} of {done} replicates left out as unreliable, {self.failed} failed"
        )
        if lost <= MOST_UNRELIABLE * done:
            return Check("reliable", True, says)
        full = self.design.fit == FULL
        todo = "look at the rows" if full else "run with --full, which draws by chains"
        return Check("reliable", False, f"{says}; those that are left say too little: {todo}")

    @property
    def _alone(self) -> Check:
        slope, told = self.tested[-1], "" if self.slopes is None else self.slopes.says
        if slope.ok:
            return Check("likelihood", True, f"{told} (p = {slope.p:.2g} of their ranks)")
        says = f"{told}: {_of_the_whole(slope)}; no fit can mend that"
        return Check("likelihood", False, says)

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

    @property
    def _together(self) -> Check:
        worst = min(self.held, key=lambda one: one.adjusted)
        if worst.adjusted >= ALPHA:
            return Check("coverage", True, self.held[0].says)
        way = "narrow" if worst.apart < 0.0 else "wide"
        says = (
            f"{_among(worst.name, worst.n)}{worst.says}: the fit makes them too {way} "
            f"(p = {worst.adjusted:.2g})"
        )
        return Check("coverage", False, says)


WHOLE = {
    LOG_POSTERIOR: (
        "the posterior as a whole is too wide or off",
        "the posterior as a whole is too narrow",
    ),
    TARP: (
        "the posterior as a whole is too narrow",
        "the posterior as a whole is too wide or off",
    ),
    WEIGHT: (
        "draws come too rarely where truths lie",
        "draws come too often where truths do not lie",
    ),
    SCORE: (
        "the likelihood is surer than its campaigns allow, before any fit",
        "the likelihood is less sure than its campaigns allow, before any fit",
    ),
}
"""What a joint rank says where it is too high, and too low."""


def _of_the_whole(tested: Tested) -> str:
    """What a joint rank says where it fails."""
    found = tested.worst or Part(EVERY, tested.ranks, tested.p)
    mean = float(found.ranks.mean())
    return (
        f"{_among(found.name, len(found.ranks))}{WHOLE[tested.name][mean < 0.5]} "
        f"(mean rank {mean:.2f}, p = {tested.adjusted:.2g})"
    )


def _among(name: str, n: int) -> str:
    return "" if name == EVERY else f"among the {n} replicates {name} "


def verdict(design: Design, rows: Sequence[Mapping[str, Any]]) -> Verdict:
    """Test the rows of a study.

    - `rows`: as `rigid.jobs.run.run` gives them.
    """
    done = [row["value"] for row in rows if row["failed"] is None]
    used = [value for value in done if value["good"]]
    names = list(dict.fromkeys(name for value in used for name in value["ranks"]))
    single = [name for name in names if name not in JOINT]
    joint = [name for name in JOINT if name in names]
    tested, together = tests(single, joint, used) if len(used) > 1 else ((), ())
    return Verdict(
        design=design,
        tested=tested,
        held=together,
        slopes=slopes(used),
        searched=seldom_missed(used),
        solver=seldom_off(used),
        replicates=len(used),
        unreliable=len(done) - len(used),
        failed=len(rows) - len(done),
        refused=sum(value["refused"] for value in done),
        cpu_s=sum(row["cost"]["cpu_s"] or 0.0 for row in rows),
    )
