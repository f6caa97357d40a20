"""The best optimum alone, from as few starts as settle it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigid.inference.descents import AGREE
from rigid.inference.newton import descend, joined, split
from rigid.inference.search import centre, prior_draws
from rigid.inference.stages import eased
from rigid.io.errors import InputError
from rigid.likelihood.problem import Problem

NOWHERE = "no start of the search led to a finite likelihood; look at units and valve programmes"
"""What is said where there is no optimum."""


class Best(NamedTuple):
    """The best optimum alone.

    - `z` (size,): noise levels in it. - `standard` (sensors, 2): gains and zeros on their standard
      scale. - `starts`: how many there were. - `agree`: whether two of them ended there.
    """

    z: np.ndarray
    standard: np.ndarray
    starts: int
    agree: bool


def best_of_few(
    problem: Problem, starts: int, seed: int, report: Callable[[int], None] = lambda _: None
) -> Best:
    """Find the best optimum alone, from as few starts as settle it: until two of them agree.

    Noise levels stand at the centre of their priors.

    - `starts`: at most; `report(done)` after each.

    Raises InputError where no start leads anywhere.
    """
    first, (z_noise, zero) = prior_draws(problem, starts, seed), centre(problem)
    ends: list[tuple[float, np.ndarray]] = []
    done, agree = 0, False
    stages = eased(problem)
    for done, z in enumerate(first, start=1):
        end = joined(problem, z, zero)
        for one in stages:
            end, there = descend(one, end, z_noise)
        report(done)
        if not np.isfinite(float(there.value)):
            continue
        ends.append((float(there.value), end))
        ends.sort(key=lambda one: one[0])
        agree = len(ends) > 1 and ends[1][0] < ends[0][0] + AGREE
        if agree:
            break
    if not ends:
        raise InputError(NOWHERE)
    z, standard = split(problem, ends[0][1], z_noise)
    return Best(np.asarray(z), np.asarray(standard), done, agree)
