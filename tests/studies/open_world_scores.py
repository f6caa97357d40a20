"""What discovery's answers on the second simulator are worth, campaign by campaign."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from discovery_scores import (
    CONFIDENT,
    LEVEL,
    NO_ANSWER,
    NOTHING,
    UNNAMED,
    Known,
    forecasts,
    lower,
    placed,
    statement,
    upper,
)
from open_world_truth import CATALOGUED, Row, alike, right_names, sort_of
from scipy.stats import kstest, kstwo

UNUSABLE = 1
"""Exit status of a run with a failed check."""
MET, MISSED, OPEN, NONE = "met", "not met", "too few to say", "-"
ROUNDING = 1e-9
"""Of a bound: that of 1 of 1 is 5 %."""


class Judged(NamedTuple):
    """A campaign: its row, what sort of campaign it is, and what is right to say first of it.

    What ended with a failed check, was refused or failed is never right in anything.
    """

    row: Row
    sort: str
    right: frozenset[str]

    @property
    def answer(self) -> Row:
        """What discovery said."""
        return self.row["answer"]

    @property
    def lost(self) -> bool:
        """Whether there is no answer."""
        return self.answer["verdict"] in NO_ANSWER

    @property
    def unusable(self) -> bool:
        """Whether a check failed."""
        return self.answer["status"] == UNUSABLE

    @property
    def sound(self) -> bool:
        """Whether the command ended well."""
        return self.answer["status"] == 0

    @property
    def said(self) -> str:
        """What is said first."""
        return statement(self.answer)

    @property
    def alarmed(self) -> bool:
        """Whether something is said to be missing, whatever the checks say."""
        return not self.lost and self.answer["verdict"] != "nothing-missing"

    @property
    def heard(self) -> bool:
        """Whether it counts for alarms and wrong names: a run that ended well, or an alarm."""
        return self.sound or self.alarmed

    @property
    def quiet(self) -> bool:
        """Whether nothing is said to be missing, in a run that ended well."""
        return self.sound and not self.alarmed

    @property
    def found(self) -> bool:
        """Whether something is said to be missing, in a run that ended well."""
        return self.sound and self.alarmed

    @property
    def names(self) -> list[tuple[str, float]]:
        """Effects of all steps, with their probabilities."""
        steps = self.answer["steps"]
        return [(step["effect"], step["probability"]) for step in steps if step.get("effect")]

    @property
    def truly(self) -> bool:
        """Whether it is an alarm all of whose steps name what acts."""
        steps = self.answer["steps"] if self.alarmed else []
        return bool(steps) and all(step.get("effect") in self.right for step in steps)

    @property
    def falsely(self) -> bool:
        """Whether it is an alarm that says anything else."""
        return self.alarmed and not self.truly

    @property
    def misnamed(self) -> bool:
        """Whether a wrong name is given with confidence, in any step."""
        return any(n not in self.right and p >= CONFIDENT for n, p in self.names)

    @property
    def flagged(self) -> bool:
        """Whether something is said to be missing, and no wrong name is given with confidence."""
        return self.found and not self.misnamed

    @property
    def rightly(self) -> bool:
        """Whether what is said first is right."""
        return self.sound and self.said in self.right

    @property
    def by_twin(self) -> bool:
        """Whether it is right by the name of a cause that leaves the same trace."""
        return self.rightly and self.sort == CATALOGUED and self.said != self.row["nearest"]

    @property
    def among(self) -> bool:
        """Whether the verdict is `indistinguishable` with a right name after a wrong first."""
        if not self.sound or self.answer["verdict"] != "indistinguishable" or self.rightly:
            return False
        others = self.answer["steps"][0].get("alternatives", [])
        return any(other["effect"] in self.right for other in others)

    @property
    def harmed(self) -> bool:
        """Whether an addition widens the gap or predicts left-out records worse."""
        made = added([self])
        return made.wider + made.worse > 0

    @property
    def in_equation(self) -> bool:
        """Whether the first step's equation is that of the cause."""
        return self.sound and placed(self.row)[0]

    @property
    def in_record(self) -> bool:
        """Whether the first step's record is one in which the cause shows."""
        return self.sound and placed(self.row)[1]


def judged(rows: Sequence[Row], known: Known) -> list[Judged]:
    """Campaigns with what is right to say of them."""
    return [Judged(row, sort_of(row), frozenset(right_names(known, row))) for row in rows]


def standing(count: int, of: int, bar: float, least: int | None = None) -> str:
    """Where a share stands to a bar that it may reach at most, by its bounds.

    - least: campaigns below which nothing is said, and from which on the bar is not met unless the
      upper bound lies below it.
    """
    if of == 0:
        return NONE
    if least is not None:
        return OPEN if of < least else MET if upper(count, of) <= bar else MISSED
    if upper(count, of) <= bar:
        return MET
    return MISSED if lower(count, of) > bar + ROUNDING else OPEN


class Added(NamedTuple):
    """Steps that added an effect: how many, those that widen the gap, that predict worse."""

    steps: int
    wider: int
    worse: int


def added(campaigns: Sequence[Judged]) -> Added:
    """Count what additions do to the gap and to the prediction of left-out records."""
    gaps = [step["gap"] for one in campaigns for step in one.answer["steps"] if step.get("gap")]
    wider = sum(gap["after"] > gap["before"] for gap in gaps)
    return Added(len(gaps), wider, sum(gap["elpd_difference"] < 0.0 for gap in gaps))


class Uniform(NamedTuple):
    """Greatest distance of p-values from a uniform law, and how great chance makes it."""

    of: int
    distance: float
    band: float


def uniform(values: Sequence[float]) -> Uniform:
    """Kolmogorov and Smirnov's distance with its 95 % band."""
    distance = kstest(values, "uniform", method="asymp").statistic  # the method is of its p-value
    return Uniform(len(values), float(distance), _band(len(values)))


@functools.cache
def _band(of: int) -> float:
    return float(kstwo.ppf(LEVEL, of))


def least_p(campaigns: Sequence[Judged]) -> list[float]:
    """Least p-value of the disagreements of each campaign, which counts all comparisons."""
    found = [one.answer.get("disagreements") for one in campaigns]
    return [min(told["p_value"] for told in listed) for listed in found if listed]


def verdict_p(campaigns: Sequence[Judged]) -> list[float]:
    """P-value on which each verdict rests."""
    found = [one.answer.get("p_value") for one in campaigns]
    return [p for p in found if p is not None]


def stated(campaigns: Sequence[Judged], known: Known) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each verdict (n,) and whether it was right (n,), of runs that ended well.

    That of a name is that of all causes which leave the same trace.
    """

    def meant(said: str) -> set[str]:
        return {said} if said in {NOTHING, UNNAMED} else alike(known, said)

    rows: list[dict[str, Any]] = [dict(one.row) for one in campaigns if one.sound]
    return forecasts(rows, lambda row: right_names(known, row), meant)
