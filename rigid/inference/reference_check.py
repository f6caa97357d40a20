"""The fast solver held against diffrax at the points that an answer rests on."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from rigid.inference.summary import Check
from rigid.io.compiled import compiled
from rigid.likelihood.channels import Piece
from rigid.likelihood.groups import AbstractGroup, MotionGroup
from rigid.likelihood.marginal import marginal_likelihood
from rigid.likelihood.problem import Problem, in_batches, predict
from rigid.physics.full import TOLERANCE
from rigid.physics.sensors import UNITS

Predictions = list[dict[str, np.ndarray]]
"""Readings of every group by quantity, (samples, tracks, walkers)."""

AT_ONCE = 8
"""Points that a thread takes at a time."""

POINTS = 32
"""Points that are solved again at most: the best fit and draws of the posterior."""

FIRST, CLEAR = 8, 1.0 / 3.0
"""Points that are solved first, and the share of every limit below which no more are: a shift at
its limit shows as less than a third of it in one case of a hundred (chi squared of six degrees of
freedom: seven draws, and the best fit)."""

MOST_STEPS = 0.5
"""Steps by which a reading may be wrong: its own rounding is as much."""

MOST_SHIFT = 0.1
"""Posterior sds by which a mean may be wrong."""

FINER = 0.01
"""Tolerance, in that of a problem which diffrax itself solves, at which it is solved again."""

LEAST_ENDED = 0.9
"""Share of the points at which the full solve must come to its end."""


@dataclass(frozen=True)
class SensorError:
    """Worst error of one sort of reading over all points.

    - `error`: in SI, `unit`. - `bar`: the sensor's step in SI, or its noise where it has none, as
      `per` says. - `record`: "record,cylinder" where it is.
    """

    quantity: str
    unit: str
    error: float
    bar: float
    per: str
    record: str

    @property
    def bars(self) -> float:
        """The error in steps, or in sds of the noise."""
        return self.error / self.bar


@dataclass(frozen=True)
class SolverCheck:
    """What the full solve says of the fast one.

    - `tolerance`: of diffrax, relative. - `points`: that were tried; `ended`: at which the full
      solve came to its end. - `sensors`: worst errors. - `differences` (ended,): log-posterior by
      the full solve less that by the fast one; None where what drives the rig is inferred as well
      and would give way.
    """

    tolerance: float
    points: int
    ended: int
    sensors: tuple[SensorError, ...]
    differences: Float[np.ndarray, " ended"] | None = None

    @property
    def shift(self) -> float | None:
        """Posterior sds by which a mean of any quantity is wrong at most, to first order.

        Weights exp(d) turn draws of the fast posterior into draws of the full one; the mean of a
        quantity q moves by cov(d, q) = corr(d, q) sd(d) sd(q).
        """
        if self.differences is None or not self.ended:
            return None
        return float(np.std(self.differences))

    @property
    def worst(self) -> SensorError | None:
        """The greatest error in steps; None where no solve ended."""
        return max(self.sensors, key=lambda s: s.bars, default=None)

    @property
    def ok(self) -> bool:
        """Whether the error does not matter."""
        worst = self.worst
        if worst is None or self.ended < LEAST_ENDED * self.points:
            return False
        return worst.bars <= MOST_STEPS and (self.shift or 0.0) <= MOST_SHIFT

    @property
    def clear(self) -> bool:
        """Whether the error matters so little that more points need not be asked."""
        worst = self.worst
        if worst is None or self.ended < self.points:
            return False
        return worst.bars <= CLEAR * MOST_STEPS and (self.shift or 0.0) <= CLEAR * MOST_SHIFT

    @property
    def says(self) -> str:
        """One sentence for the report."""
        if self.worst is None:
            return f"diffrax did not come to its end at any of {self.points} points"
        worst = self.worst
        unit = "step" if worst.per == "step" else "noise sd"
        lost = self.points - self.ended
        open_ends = f" ({lost} more did not end)" if lost else ""
        told = (
            f"solved again by diffrax at {self.ended} points{open_ends}: "
            f"readings are off by {worst.bars:.2g} {unit}s of the sensor at most ({worst.quantity} "
            f"of {worst.record}; limit {MOST_STEPS:g})"
        )
        if np.isinf(worst.error):
            told = f"{worst.quantity} of {worst.record} comes to no number where diffrax ends"
        if self.differences is None:
            return told
        most = np.max(np.abs(self.differences))
        return (
            f"{told}, the log-posterior by {most:.2g}; no mean moves by more than "
            f"{self.shift:.2g} posterior sds (limit {MOST_SHIFT:g})"
        )

    @property
    def check(self) -> Check:
        """The check of the report."""
        return Check("solver", self.ok, self.says)

    def values(self) -> dict[str, Any]:
        """The entries of `solver` in result.json."""
        return {
            "tolerance": self.tolerance,
            "points": self.points,
            "ended": self.ended,
            "sensors": [asdict(s) | {"bars": s.bars} for s in self.sensors],
            "log_posterior": None if self.differences is None else self.differences.tolist(),
            "shift": self.shift,
        }


def against_reference(
    problem: Problem,
    best: Float[np.ndarray, " size"],
    draws: Float[np.ndarray, "draws size"],
    seed: int,
    tolerance: float = TOLERANCE,
) -> SolverCheck | None:
    """Solve the best fit and some draws again by diffrax; None where there is nothing to solve.

    - `best`, `draws`: in z. - `tolerance`: of diffrax where steps solve the problem.
    """
    return solved_again(problem, np.concatenate([best[None], picked(draws, seed)]), tolerance)


def solved_again(
    problem: Problem, z: Float[np.ndarray, "points size"], tolerance: float = TOLERANCE
) -> SolverCheck | None:
    """Solve points again by diffrax; None where there is nothing to solve.

    - `tolerance`: of diffrax where steps solve the problem.
    """
    if nothing_solved(problem):
        return None
    if problem.tolerance is not None:
        tolerance = FINER * problem.tolerance

    def first(count: int) -> SolverCheck:
        return compared(problem, *both_ways(problem, z[:count], tolerance), tolerance)

    return until_clear(first, len(z))


def until_clear(first: Callable[[int], SolverCheck], count: int) -> SolverCheck:
    """Solve the first few of some points again, and all of them where these leave a doubt.

    - `first`: solves so many of the first of them. - `count`: of all.
    """
    few = first(min(FIRST, count))
    return few if few.clear or few.points == count else first(count)


def both_ways(
    problem: Problem, z: Float[np.ndarray, "points size"], tolerance: float
) -> tuple[Mapping[str, Array], Predictions, Predictions]:
    """Values (points,) of z by label, and readings there as the problem is solved and in full."""
    parts = in_batches(predict, problem, z)
    fast = [
        {q: np.concatenate([p[g][q][..., :n] for p, n in parts], axis=2) for q in group.quantities}
        for g, group in enumerate(problem.groups)
    ]
    values = problem.parameters.values(jnp.asarray(z))
    return values, fast, by_diffrax(problem, values, tolerance)


def nothing_solved(problem: Problem) -> bool:
    """Whether all records are motions, whose force follows without a solve."""
    return all(isinstance(group, MotionGroup) for group in problem.groups)


def picked(draws: Float[np.ndarray, "draws size"], seed: int) -> Float[np.ndarray, "some size"]:
    """Return the draws that are solved again."""
    rng = np.random.default_rng([seed, 4])
    return draws[rng.choice(len(draws), min(POINTS - 1, len(draws)), replace=False)]


def by_diffrax(problem: Problem, values: Mapping[str, Array], tolerance: float) -> Predictions:
    """Readings of every group by the full solve, (samples, tracks, walkers).

    - `values`: SI by label, (walkers,).

    Not compiled as a whole: the stretches of a group's records share one program.
    """
    count = len(next(iter(values.values())))
    chunks = [slice(i, min(i + AT_ONCE, count)) for i in range(0, count, AT_ONCE)]
    groups = problem.with_tolerance(tolerance).groups

    def one(asked: tuple[AbstractGroup, slice]) -> dict[str, np.ndarray]:
        group, chunk = asked
        found = group.predict({label: v[chunk] for label, v in values.items()})
        shape = (group.samples, len(group.tracks), chunk.stop - chunk.start)
        return {q: np.broadcast_to(np.asarray(s), shape) for q, s in found.items()}

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        parts = list(pool.map(one, [(g, c) for g in groups for c in chunks]))
    by_group = [parts[i : i + len(chunks)] for i in range(0, len(parts), len(chunks))]
    return [{q: np.concatenate([p[q] for p in row], axis=2) for q in row[0]} for row in by_group]


def compared(
    problem: Problem,
    values: Mapping[str, Array],
    fast: Predictions,
    exact: Predictions,
    tolerance: float,
) -> SolverCheck:
    """Compare readings by steps with those of the full solve.

    - `values`: SI by label, (walkers,); noise levels are among them.
    """
    ended = np.all([np.isfinite(s).all(axis=(0, 1)) for one in exact for s in one.values()], axis=0)
    both = [
        np.asarray(_log_likelihood(problem, jax.tree.map(jnp.asarray, series), dict(values)))
        for series in (fast, exact)
    ]
    return SolverCheck(
        tolerance=tolerance,
        points=len(ended),
        ended=int(ended.sum()),
        sensors=_worst(problem, fast, exact, ended) if ended.any() else (),
        differences=both[1][ended] - both[0][ended],
    )


@compiled
def _log_likelihood(problem: Problem, series: list, values: dict[str, Array]) -> Array:
    """Log-likelihood (walkers,) of predicted readings."""
    return marginal_likelihood(problem.pieces, series, values).value


def _worst(
    problem: Problem, fast: Predictions, exact: Predictions, ended: Bool[np.ndarray, " points"]
) -> tuple[SensorError, ...]:
    """The worst error of each quantity."""
    found: dict[str, SensorError] = {}
    for piece in problem.pieces:
        both = (one[piece.group][piece.quantity][..., ended] for one in (fast, exact))
        error = _error(problem, piece, np.abs(np.subtract(*both)))
        known = found.get(piece.quantity)
        if known is None or error.bars > known.bars:
            found[piece.quantity] = error
    return tuple(found.values())


def _error(
    problem: Problem, piece: Piece, off: Float[np.ndarray, "samples tracks points"]
) -> SensorError:
    """The worst error of a piece, where something was read."""
    size = np.max(off[:, list(piece.tracks)], axis=2)
    size = np.where(np.asarray(piece.weight) > 0, np.nan_to_num(size, nan=np.inf), 0.0)
    track = int(np.argmax(np.max(size, axis=0)))
    sheet = piece.sheet
    return SensorError(
        quantity=piece.quantity,
        unit=UNITS[piece.quantity],
        error=float(size.max()),
        bar=float(sheet.step or sheet.noise),
        per="step" if sheet.step else "noise",
        record=problem.groups[piece.group].tracks[piece.tracks[track]].label,
    )
