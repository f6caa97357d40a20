"""Other optima along the profiles of an optimum.

What a sum of relaxing parts does to a record can be shared out among them in more ways than one: a
friction that relaxes within a sample is like one that does not relax at all. Each way is an
optimum, and all starts of a search may end in the lesser of two, for it is the wider one from afar
(docs/studies/validation-notes.md, campaign 15 of seed 60601: 16 of 16). The profile of a part leads
from one to the other: the part is held, a stride at a time, and all else led to its optimum given
it (Raue et al. 2009, Bioinformatics 25:1923). Where the profile rises and falls again, another
optimum lies behind.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

from rigid.inference.newton import LONGEST, ROUGH, Expansion, descend, expanded
from rigid.inference.sums import sums_of
from rigid.likelihood.problem import Problem

STRIDE, SHORT = 0.5, 0.125
"""By how much a part is moved at a time, and where Newton steps fail after that [prior sds]."""
FARTHEST = 3.0
"""Prior sds from the centre where a profile ends."""
TOO_HIGH = 40.0
"""Nats above where it began at which a profile is left: there it has lost a weight of 1e-17."""
FALL = 0.5
"""Nats by which a profile falls where another optimum lies behind."""
STEPS, ENOUGH = 10, 4
"""Newton steps to a point of a profile at most, and after which one is left that promises no more.
The first steps promise too little: where they begin, most lies far from all measured."""
SETTLED = 1.0
"""Nats that the last step to a point of a profile promises."""

Local = Callable[[np.ndarray], Expansion]
"""w (n,), as `newton.joined` makes it -> the negative log-posterior around it."""


class Place(NamedTuple):
    """A point w (n,) and the negative log-posterior around it."""

    w: np.ndarray
    there: Expansion

    @property
    def value(self) -> float:
        """Minus the log-posterior."""
        return float(self.there.value)


def other_optima(
    problem: Problem, w: np.ndarray, there: Expansion, z_noise: np.ndarray
) -> list[Place]:
    """Return where the profiles of all parts of sums lead that fall again, led to their optima.

    - `w` (n,), `there`: an optimum and what is around it. - `z_noise`: noise levels, held.

    Where there is no sum nothing is evaluated.
    """
    entries = _entries_of_parts(problem)
    begin = Place(w, there)

    def around(at: np.ndarray) -> Expansion:
        return expanded(problem, at, z_noise)

    def behind(which: tuple[int, float]) -> Place | None:
        over = over_a_barrier(profile(around, begin, *which))
        return None if over is None else Place(*descend(problem, over.w, z_noise))

    ways = [(entry, sign) for entry in entries for sign in (-1.0, 1.0)]
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return [found for found in pool.map(behind, ways) if found is not None]


def _entries_of_parts(problem: Problem) -> list[int]:
    """Entries of w of all parts of sums."""
    free = [p.label for p in problem.parameters.sampled if p.base != "noise"]
    return [free.index(part.label) for _, parts in sums_of(problem) for part in parts]


def profile(around: Local, begin: Place, entry: int, sign: float) -> list[Place]:
    """Follow the profile of an entry of w from an optimum, up (`sign` 1) or down (-1).

    Returns its points, that where it begins first. It ends FARTHEST from the centre, where it is
    TOO_HIGH, or where Newton steps lead no further.
    """
    found = [begin]
    while found[-1].value < begin.value + TOO_HIGH:
        to = partial(_moved, around, found[-1], entry, limit=begin.value + TOO_HIGH)
        here = to(sign * STRIDE) or to(sign * SHORT)
        if here is None:
            break
        found.append(here)
        if sign * here.w[entry] >= FARTHEST:
            break
    return found


def _moved(around: Local, place: Place, entry: int, by: float, limit: float) -> Place | None:
    """Move an entry of w, and all others to their optimum given it; None where that fails.

    They begin where the slopes at `place` say that they go. After ENOUGH steps a point whose
    expansion promises nothing below `limit` is returned as it is.
    """
    rest = np.delete(np.arange(len(place.w)), entry)
    across = np.asarray(place.there.information)[rest, entry]
    step = -by * np.linalg.solve(_known(place.there, rest), across)
    w = place.w.copy()
    w[entry] += by
    w[rest] += _shortened(step)
    kept: Place | None = None
    for done in range(STEPS):
        here = Place(w, around(w))
        if not here.value <= (np.inf if kept is None else kept.value + ROUGH):
            if kept is None:
                return None
            step = 0.5 * step
        else:
            slope = np.asarray(here.there.gradient)[rest]
            whole = -np.linalg.solve(_known(here.there, rest), slope)
            promise = -0.5 * float(slope @ whole)
            kept, step = here, _shortened(whole)
            hopeless = done >= ENOUGH and here.value - promise > limit
            if promise < SETTLED or hopeless:
                return kept
        w = kept.w.copy()
        w[rest] += step
    return None


def _known(there: Expansion, rest: np.ndarray) -> np.ndarray:
    return np.asarray(there.information)[np.ix_(rest, rest)]


def _shortened(step: np.ndarray) -> np.ndarray:
    return step * LONGEST / max(LONGEST, float(np.abs(step).max()))


def over_a_barrier(places: list[Place]) -> Place | None:
    """Return the lowest point of a profile behind a fall of it; None where it only rises."""
    value = np.array([place.value for place in places])
    behind = np.maximum.accumulate(value) - value > FALL
    if not behind.any():
        return None
    return places[int(np.argmin(np.where(behind, value, np.inf)))]
