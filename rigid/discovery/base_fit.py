"""Where discovery begins: the model as specified, led as near to the records as it can come.

A model that lacks something does not fit to the noise of the sensors' sheets; led to the optimum of
that likelihood its numbers end where no rig is. So noise levels follow what is left over, and its
samples count as far as they differ from their neighbours (`rigid.likelihood.correlation`), from the
first step on: far from the records a fit is held by its priors, and comes away from them no further
than the records demand.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from jax import Array

from rigid.inference.few_starts import NOWHERE, Best
from rigid.inference.newton import Expansion, descend, is_noise, joined, split
from rigid.inference.search import centre, prior_draws
from rigid.inference.stages import eased
from rigid.io.errors import InputError
from rigid.likelihood.correlation import noise_law
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.ascent import refined
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import Family
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.local import LOUDER, LocalFit, fitted_noise, with_noise, with_weights
from rigid.localfit.samples import lay_out

ROUNDS, FIRST_STEPS, STEPS = 6, 12, 36
"""In which the samples' weights follow; turns of the fit in the first of them, and in others."""
NONE_GIVEN: Mapping[str, AbstractPrior] = MappingProxyType({})
SAME = 0.05
"""Share by which weights may still change at the end."""
AGREE, MET = 1.0, 1e-3
"""Nats between two ends that are one, by the parabola around one of them; and of the easier
problem's."""


def best_base(
    problem: Problem, family: Family, starts: int, seed: int, report: Callable[[int], None]
) -> Best:
    """Find the best fit from as few starts as settle it: until two of them agree.

    - `family`: a program of the problem. - `starts`: draws of the prior at most, its centre first;
      `report(done)` after each. Those that louder noise leads to one place go on as one.

    Raises InputError where no start leads anywhere.
    """
    best, agree, done = None, False, 0
    met: list[np.ndarray] = []
    for done, z in enumerate(prior_draws(problem, starts, seed), start=1):
        near, there = _coarsely(problem, z)
        agree = any(_between(near - other, there.information) < MET for other in met)
        if not agree and np.isfinite(float(there.value)):
            met.append(near)
            begun = begun_at(problem, family, _parted(problem, near))
            if begun.finite:
                end = led_on(begun)
                agree = best is not None and _between(best.w - end.w, best.information) < AGREE
                best = end if best is None else _better(best, end)
        report(done)
        if agree and best is not None:
            break
    if best is None:
        raise InputError(NOWHERE)
    z, standard = split(problem, best.w, best.z_noise)
    return Best(np.asarray(z), np.asarray(standard), done, agree)


def begun_at(
    problem: Problem,
    family: Family,
    best: tuple[np.ndarray, np.ndarray],
    given: Mapping[str, AbstractPrior] = NONE_GIVEN,
) -> LocalFit:
    """The model as specified at a place, all samples counting alike.

    - `best`: z (size,), noise levels in it, and gains and zeros (sensors, 2).
    - `given`: priors of parameters of what may be added, by label, that go before their own.
    """
    layout = lay_out(problem)
    every = layout.weighed((layout.weight > 0.0).astype(float))
    point = Point(
        Hypothesis(problem, given=given), every, start(problem, *best), best[0][is_noise(problem)]
    )
    return expanded(family, point)


def led_on(local: LocalFit) -> LocalFit:
    """Lead a fit to its optimum; noise levels and the samples' weights follow what is left over."""
    local = with_noise(local, fitted_noise(local, LOUDER))
    for number in range(ROUNDS):
        weight = _weight(local)
        if number and np.allclose(weight, local.layout.weight, rtol=SAME):
            break
        lighter = with_weights(local, weight)
        lighter = with_noise(lighter, fitted_noise(lighter, LOUDER))
        local = refined(lighter, STEPS if number else FIRST_STEPS, loudest=LOUDER)
    return local


def _coarsely(problem: Problem, z: np.ndarray) -> tuple[np.ndarray, Expansion]:
    """Where easier problems lead from z (size,), and the last of them expanded there.

    Where there is none, the problem itself leads.
    """
    (z_noise, zero), stages = centre(problem), eased(problem)
    end = joined(problem, z, zero)
    for easier in stages[:-1] or stages:
        end, there = descend(easier, end, z_noise)
    return end, there


def _parted(problem: Problem, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    z, standard = split(problem, end, centre(problem)[0])
    return np.asarray(z), np.asarray(standard)


def _weight(local: LocalFit) -> np.ndarray:
    """One over the correlation time of what is left over, for every sample (n,)."""
    layout = local.layout
    weight = layout.read.astype(float)
    score = with_weights(local, weight).terms.score
    for number in range(len(layout.channels)):
        rows = layout.channel == number
        weight[rows] /= noise_law(score[rows], layout.read[rows]).time
    return weight


def _between(moved: np.ndarray, information: Array | np.ndarray) -> float:
    """Nats between two places, by a parabola."""
    return 0.5 * float(moved @ np.asarray(information) @ moved)


def _better(one: LocalFit, other: LocalFit) -> LocalFit:
    """The one of two fits that is likelier where samples count as little as in either."""
    weight = np.minimum(one.layout.weight, other.layout.weight)

    def value(local: LocalFit) -> float:
        same = with_weights(local, weight)
        return with_noise(same, fitted_noise(same, LOUDER)).value

    return max(one, other, key=value)
