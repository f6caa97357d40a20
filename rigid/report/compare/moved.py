"""What moved between two runs, and by how many standard deviations.

The variance of a difference is the sum of both variances only where the two runs rest on different
records. Runs that share records are correlated. Where one run's records are a part of the other's
and all else is the same, the difference of variances is the variance of the difference, as for any
efficient estimate against one from less data (Hausman 1978, Econometrica 46, 1251). Where the model
differs, the files do not tell the correlation: the sd of the difference lies between the difference
and the sum of both sds, and the larger of the two sds is taken as the measure.
"""

import math
from dataclasses import dataclass
from typing import Literal

from rigid.report.compare.runs import Figures, Run

Rule = Literal["independent", "repeated", "nested", "shared", "unknown"]

SAYS: dict[Rule, str] = {
    "independent": "no record in common: the sd of a difference is the root of the sum of squares "
    "(constants that both take from the same prior still tie them)",
    "repeated": "the same records under the same model: what differs is the sampling alone; the "
    "larger of both sds is the measure, and nothing should move by much of it",
    "nested": "the records of one are a part of the other's, under the same model: the variance of "
    "a difference is the difference of the variances, not their sum",
    "shared": "records in common under another model or other priors: the sd of a difference is "
    "not the root of the sum of squares and does not follow from the two files; the larger of "
    "both sds is the measure",
    "unknown": "digests are missing, so records may be shared: the larger of both sds is the "
    "measure",
}

MOVED = 2.0
"""Standard deviations from which on a parameter counts as moved."""

ORDERS = 2.0
"""Ratio of the 95 to the 5 % quantile from which on a positive number is compared in logarithms."""

SDS_IN_90 = 3.29
"""A 90 % interval of a Gaussian in standard deviations."""

LEAST_SHARE = 0.28
"""Of the larger sd: the least sd of a nested difference, for variances have a Monte Carlo error.
From the 5 and 95 % quantiles of n effective draws of a Gaussian that of a variance is 1.81/sqrt(n),
that of the difference of two 2.57/sqrt(n): 8 % at the 1,000 with which a fit ends, of which 0.28 is
the root."""


@dataclass(frozen=True)
class Sharing:
    """How the records of two runs lie to each other.

    - `reference`, `run`: names. - `common`: records of both, by name in `run`. - `rule`.
    """

    reference: str
    run: str
    common: tuple[str, ...]
    rule: Rule


@dataclass(frozen=True)
class Move:
    """One parameter in one run beside the reference.

    - `difference` [unit]; in `logarithms` the natural logarithm of the ratio.
    - `sd`: of the difference, or the measure taken for it. - `z`: difference/sd.
    - `bounds`: least and most that |z| may be, where the correlation is not known.
    """

    parameter: str
    unit: str
    reference: str
    run: str
    before: Figures
    after: Figures
    difference: float
    sd: float
    logarithms: bool
    rule: Rule
    bounds: tuple[float, float] | None

    @property
    def z(self) -> float | None:
        """By how many standard deviations it moved."""
        return self.difference / self.sd if self.sd > 0.0 else None

    @property
    def moved(self) -> bool:
        """Whether it moved by more than `MOVED`."""
        return self.z is not None and abs(self.z) > MOVED


def sharing(reference: Run, run: Run) -> Sharing:
    """Whether two runs share records, told by their digests."""
    common = tuple(label for label, digest in run.sha256.items() if digest in reference.digests)
    if not (reference.sha256 and run.sha256):
        rule: Rule = "unknown"
    elif not common:
        rule = "independent"
    elif same_model(reference, run) and reference.sha256 == run.sha256:
        rule = "repeated"
    elif same_model(reference, run) and _nested(reference, run):
        rule = "nested"
    else:
        rule = "shared"
    return Sharing(reference.name, run.name, common, rule)


def _nested(reference: Run, run: Run) -> bool:
    """Whether the records of one are a true part of the other's."""
    mine, theirs = set(run.sha256.items()), set(reference.sha256.items())
    return mine < theirs or theirs < mine


def same_model(reference: Run, run: Run) -> bool:
    """Whether two specs say the same of rig, model, priors and sensors."""
    if not (reference.values and run.values):
        return False
    left_out = {"records", "sampler", "title", "bands", "solve", "simulated"}
    return _without(reference, left_out) == _without(run, left_out)


def _without(run: Run, names: set[str]) -> dict:
    return {key: value for key, value in run.values.items() if key not in names}


def moves(reference: Run, run: Run) -> list[Move]:
    """Every parameter of both, the farthest moved first."""
    rule = sharing(reference, run).rule
    both = [label for label in reference.parameters if label in run.parameters]
    found = [_move(label, reference, run, rule) for label in both]
    return sorted(found, key=lambda one: -abs(one.z or 0.0))


def _move(label: str, reference: Run, run: Run, rule: Rule) -> Move:
    before, after = reference.parameters[label], run.parameters[label]
    logarithms = _spans_orders(before) or _spans_orders(after)
    logarithms = logarithms and min(before.q05, after.q05) > 0.0
    if logarithms:
        difference = math.log(after.median / before.median)
        sds = [math.log(one.q95 / one.q05) / SDS_IN_90 for one in (before, after)]
    else:
        difference = after.median - before.median
        sds = [before.sd, after.sd]
    sd = {
        "independent": math.hypot(*sds),
        "nested": max(math.sqrt(abs(sds[0] ** 2 - sds[1] ** 2)), LEAST_SHARE * max(sds)),
    }.get(rule, max(sds))
    bounds = None
    if rule in ("shared", "unknown") and sum(sds) > 0.0:
        apart = abs(sds[0] - sds[1])
        most = abs(difference) / apart if apart > 0.0 else math.inf if difference else 0.0
        bounds = (abs(difference) / sum(sds), most)
    return Move(
        label, after.unit, reference.name, run.name, before, after, difference, sd, logarithms,
        rule, bounds,
    )  # fmt: skip


def _spans_orders(one: Figures) -> bool:
    return one.q05 > 0.0 and one.q95 / one.q05 > ORDERS
