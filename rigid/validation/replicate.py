"""One replicate: a campaign drawn, fitted and ranked. A pure function of what its job is given."""

import dataclasses
import hashlib
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from rigid.inference.calibrate import Asked, calibrate, propose
from rigid.inference.sampling import covers
from rigid.inference.search import Found, search_from
from rigid.inference.search_cache import Searched
from rigid.inference.steady_first import beginnings
from rigid.io.cli import Options
from rigid.jobs.job import Given
from rigid.likelihood.problem import Problem
from rigid.spec import Spec
from rigid.validation.broken import broken, kept
from rigid.validation.campaign import Base, Campaign, draw, read_base
from rigid.validation.design import COLOUR, FULL, IGNORED, SLOPES, Design, read_arguments
from rigid.validation.draws import Weighted, chained, of_chain, sliced, weighted
from rigid.validation.missed import missed
from rigid.validation.ranks import ranks
from rigid.validation.score import SCORE, Score, score
from rigid.validation.solved import solved

FARTHEST = 3.0
"""Prior sds from the centre to which truths are moved that a descent begins at."""
DIGITS = 6


def one(given: Given) -> dict[str, Any]:
    """Draw, fit and rank the replicate of a job.

    Returns `ranks` by quantity; `width` (posterior sd over prior sd), `error` (posterior mean less
    truth, in posterior sds) and `foretold` (the same, as the slope at the truth has it) by
    parameter; that slope's length; how the posterior was summed; by how much the search missed the
    better optimum; what was shifted; how far steps are from diffrax at the truth.
    """
    spec, design, number = read_arguments(given)
    if design.broken == IGNORED:
        design = dataclasses.replace(design, colour=COLOUR)
    around = tuple(sorted(design.around.items()))
    base = _base(spec.text, str(spec.path), str(given.root), around, _Held(spec))
    campaign = draw(base, design, number)
    told = {"number": number, "campaign": _mark(campaign), "refused": campaign.refused}
    if design.fit == SLOPES:
        problem = broken(campaign.problem, design.broken, campaign.z)
        return told | _unfitted(_slope(problem, campaign))
    rng = np.random.default_rng([design.seed, number, 1])
    known, draws = (_full if design.fit == FULL else _fast)(base, campaign, design, rng)
    problem = known.found.problem
    truth = kept(problem, campaign.z, campaign.problem)
    sd = np.sqrt(np.diag(draws.covariance))
    labels = problem.parameters.labels
    slope = _slope(problem, campaign)
    # The same point of reference for TARP, however a campaign was drawn from.
    again = np.random.default_rng([design.seed, number, 2])
    found = ranks(known, draws, truth, campaign.sensors, again) | {SCORE: slope.rank}
    return (
        told
        | {
            "good": bool(draws.good),
            "ess": round(draws.ess, 1),
            "by": draws.by,
            "pareto_k": None if draws.pareto_k is None else round(draws.pareto_k, 3),
            "modes": len(known.found.optima),
            "missed": round(missed(known.found, np.clip(truth, -FARTHEST, FARTHEST)), 2),
            "ranks": _rounded(found),
            "width": _rounded(dict(zip(labels, sd, strict=True))),
            "error": _rounded(dict(zip(labels, (draws.mean - truth) / sd, strict=True))),
            "shifted": _told_shift(problem, campaign, draws),
            "solver": solved(campaign.problem, campaign.z),
        }
        | _told_slope(slope)
    )


def _slope(problem: Problem, campaign: Campaign) -> Score:
    """The slope at the truth of what is fitted."""
    return score(problem, kept(problem, campaign.z, campaign.problem), campaign.sensors)


def _unfitted(slope: Score) -> dict[str, Any]:
    """What a row says where nothing is fitted."""
    return {
        "good": True,
        "by": None,
        "ranks": _rounded({SCORE: slope.rank}),
        "width": {},
    } | _told_slope(slope)


def _told_slope(slope: Score) -> dict[str, Any]:
    """What a row says of a slope."""
    told = {"length": round(slope.length, DIGITS), "size": slope.size}
    return {"slope": told, "foretold": _rounded(slope.errors)}


def _mark(campaign: Campaign) -> str:
    """What tells a campaign from others, whoever fits it."""
    data = b"".join(np.asarray(piece.data).tobytes() for piece in campaign.problem.pieces)
    return hashlib.sha256(data).hexdigest()[:16]


class _Held:
    """A spec that takes no part in what is remembered: text and places tell it apart."""

    def __init__(self, spec: Spec):
        self.spec = spec

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Held)

    def __hash__(self) -> int:
        return 0


@lru_cache(maxsize=1)
def _base(text: str, path: str, root: str, around: tuple, held: _Held) -> Base:  # noqa: ARG001
    """The spec's own campaign, read once for all replicates of a process."""
    return read_base(held.spec, dict(around))


def _fast(
    base: Base, campaign: Campaign, design: Design, rng: np.random.Generator
) -> tuple[Searched, Weighted]:
    """Weighted draws of the law around the optima that the search of the command finds.

    Where their weights do not do, draws at conditional modes of their own; where those do not
    either, the draws of a short chain that begins in that law.
    """
    problem = broken(campaign.problem, design.broken, campaign.z)
    first = beginnings(base.spec, campaign.records, problem, int(rng.integers(2**31)))
    found = search_from(problem, first.z, counts=first.counts)
    found = _without_colour(found, problem, design)
    known = propose(found, rng)
    draws = weighted(known, rng) if covers(known) else None
    if draws is None or not draws.good:
        draws = sliced(known, rng)
    if draws is None or not draws.good:
        draws = chained(known, int(rng.integers(2**31)))
    return known, draws


def _without_colour(found: Found, problem: Problem, design: Design) -> Found:
    """A search whose problem takes correlated residuals for independent ones, where asked for."""
    ignored = design.broken == IGNORED
    return dataclasses.replace(found, problem=problem) if ignored else found


def _full(
    base: Base, campaign: Campaign, design: Design, rng: np.random.Generator
) -> tuple[Searched, Weighted]:
    """Draws of the chain that the command makes, its search and its stopping rule included."""
    seed = int(rng.integers(2**31))
    spec = base.spec
    options = Options(str(spec.path), None, seed, resume=False, quiet=True, as_json=False)
    problem = broken(campaign.problem, design.broken, campaign.z)
    with tempfile.TemporaryDirectory(prefix="rigid-") as folder:
        done = calibrate(Asked(spec, campaign.records, problem), options, Path(folder))
    return done.known, of_chain(done.problem, done.draws)


def _rounded(values: Mapping[str, float]) -> dict[str, float]:
    return {name: round(float(value), DIGITS) for name, value in values.items()}


def _told_shift(problem: Problem, campaign: Campaign, draws: Weighted) -> dict[str, Any] | None:
    """What was drawn from elsewhere, and the errors that it leads to expect, in posterior sds.

    Where the posterior is Gaussian, a truth that lies z prior sds from the centre moves the mean of
    every parameter away from its truth by minus z times its covariance with that constant.
    """
    if campaign.shifted is None:
        return None
    label, by = campaign.shifted
    covariance = draws.covariance
    moved = -by * covariance[:, problem.parameters.index(label)] / np.sqrt(np.diag(covariance))
    labels = problem.parameters.labels
    return {"label": label, "by": by, "expected": _rounded(dict(zip(labels, moved, strict=True)))}
