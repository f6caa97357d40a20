"""How much differences between laws scatter from campaign to campaign, by simulation.

Eight records that are unlike one another give no standard error of a sum over them. So campaigns
are drawn from a fitted law: its readings with noise of the fit's own size. Every law is fitted to
each of them by the parabola around its fit to the real ones, with the integrals that the real ones
get; what their differences scatter by is the standard error. No simulation of the rig is needed.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigid.localfit.integral import Shape, shape_of
from rigid.localfit.leave_one_out import Judged, Rows
from rigid.localfit.local import LocalFit

CAMPAIGNS = 200
AT_ONCE = 25


class Scattered(NamedTuple):
    """What simulated campaigns say of a law, up to what is common to all laws.

    - `evidence` (campaigns,): log evidence. - `density` (campaigns, parts): log predictive density.
    """

    evidence: np.ndarray
    density: np.ndarray


def scattered(
    true: LocalFit,
    fits: Mapping[str, Judged],
    parts: Sequence[Rows],
    seed: int,
) -> dict[str, Scattered]:
    """Draw campaigns that a law would make and judge laws by them.

    - `true`: the law. - `fits`: of the laws to judge.
    - `parts`: rows that are left out in turn; rows in none of them count for the evidence alone.
    """
    rng = np.random.default_rng(seed)
    curvature = np.maximum(true.terms.curvature, 0.0)
    judges = {name: Judge(one, true, parts) for name, one in fits.items()}
    found: dict[str, list[Scattered]] = {name: [] for name in fits}
    for _ in range(CAMPAIGNS // AT_ONCE):
        scores = np.sqrt(curvature) * rng.standard_normal((AT_ONCE, len(curvature)))
        for name, judge in judges.items():
            found[name].append(judge(scores))
    return {
        name: Scattered(*(np.concatenate(column) for column in zip(*rows, strict=True)))
        for name, rows in found.items()
    }


class Judge:
    """One law on campaigns of another.

    A sample's log-likelihood is -b (e + m)^2/2 with noise e and the law's miss m; b e^2 is common
    to all laws and left out. b e is the sample's score at the true reading, and that is how noise
    is given: of a real campaign, rounded by a converter, it can be had exactly.

    - `one`: the law. - `true`: the fit of the law that makes the campaigns. - `parts`: as in
      `scattered`.
    """

    def __init__(self, one: Judged, true: LocalFit, parts: Sequence[Rows]):
        local = one.local
        curvature = np.maximum(true.terms.curvature, 0.0)
        miss = local.residual - true.residual
        rest = ~np.any(np.array(parts), axis=0)
        rows = [np.flatnonzero(part) for part in (*parts, rest)]
        self._order = np.concatenate(rows)
        self._ends = np.cumsum([0, *(len(r) for r in rows)])
        self._columns = np.column_stack([local.design, miss])[self._order]
        self._shape = shape_of(local, one.amplitudes, curvature)
        self._without = [self._less(local.design[r], curvature[r]) for r in rows[:-1]]
        steady = curvature * miss
        self._gradient = np.array([local.design[r].T @ steady[r] for r in rows])
        self._value = np.array([-0.5 * steady[r] @ miss[r] for r in rows])

    def _less(self, design: np.ndarray, curvature: np.ndarray) -> Shape:
        return self._shape.without(design.T @ (design * curvature[:, None]))

    def __call__(self, scores: np.ndarray) -> Scattered:
        """Judge campaigns; `scores` (campaigns, n): of their samples at the true readings."""
        ordered = scores[:, self._order]
        told = np.stack(
            [ordered[:, a:b] @ self._columns[a:b] for a, b in itertools.pairwise(self._ends)],
            axis=1,
        )
        gradient, value = self._gradient + told[..., :-1], self._value - told[..., -1]
        all_gradient, all_value = gradient.sum(axis=1), value.sum(axis=1)
        evidence = self._shape.integral(all_gradient, all_value)
        rest = [
            shape.integral(all_gradient - gradient[:, i], all_value - value[:, i])
            for i, shape in enumerate(self._without)
        ]
        return Scattered(evidence, evidence[:, None] - np.stack(rest, axis=1))
