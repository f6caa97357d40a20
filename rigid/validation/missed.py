"""Whether a search has missed a better optimum than its best: the one that the truth leads to."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rigid.inference.descents import AGREE
from rigid.inference.newton import descend, expanded, is_noise, joined
from rigid.inference.search import Found
from rigid.inference.summary import Check
from rigid.validation.tested import seldom


def missed(found: Found, near: np.ndarray) -> float:
    """Nats by which the optimum next to the truth is better than the best one found.

    - `near` (size,): the truth. It is led to an optimum without detours, noise levels held at those
      of the best one. Zero where that is no better by AGREE: optima are known no better.
    """
    problem, best = found.problem, found.optima[0]
    z_noise = best.z[is_noise(problem)]
    there = expanded(problem, joined(problem, best.z, best.standard), z_noise)
    _, other = descend(problem, joined(problem, near, np.zeros_like(best.standard)), z_noise)
    better = float(there.value) - float(other.value)
    return better if better > AGREE else 0.0


def seldom_missed(used: Sequence[Mapping[str, Any]]) -> Check | None:
    """Check how many searches have missed a better optimum; None for rows that do not say.

    - `used`: values of rows.
    """
    nats = [float(value["missed"]) for value in used if value.get("missed") is not None]
    if not nats:
        return None
    many, most = sum(one > 0.0 for one in nats), max(nats)
    says = (
        f"the search missed a better optimum, next to the truth, in {many} of {len(nats)} campaigns"
    )
    if many:
        says = f"{says}, by up to {most:.1f} nats"
    if seldom(many, len(nats)):
        return Check("search", True, says)
    return Check("search", False, f"{says}; raise [sampler] starts, or narrow priors")
