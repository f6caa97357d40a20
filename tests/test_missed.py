"""Searches that miss the optimum next to the truth."""

import dataclasses

import numpy as np
import pytest
from rigs import release_problem
from test_validation import row_of

from rigid.inference.newton import descend, joined, split
from rigid.inference.search import Optimum, search_from
from rigid.validation.design import Design
from rigid.validation.missed import missed
from rigid.validation.verdict import verdict


@pytest.mark.slow
def test_a_better_optimum_that_the_search_has_missed_is_told():
    """The release's trap: an optimum with a stiffer friction, thousands of nats below the best."""
    release = release_problem({"k_LC": 6e7, "mu": 2e4}, samples=192, noise=0.1)
    near, trap = (at_values(release, k_LC=k, mu=mu) for k, mu in ((6e7, 2e4), (3.5e7, 4.7e5)))
    found = search_from(release, near[None])
    lesser = dataclasses.replace(found, optima=(fitted_at(release, trap),))
    assert missed(found, near) == 0.0
    assert missed(found, trap) == 0.0  # a lesser one next to the truth is none that was missed
    assert missed(lesser, near) > 1e3


def fitted_at(problem, z: np.ndarray) -> Optimum:
    """The optimum that a point leads to, without detours."""
    sensors = np.zeros((len(problem.sensors), 2))
    w, there = descend(problem, joined(problem, z, sensors), np.zeros(1))
    z, standard = (np.asarray(part) for part in split(problem, w, np.zeros(1)))
    return Optimum(z, standard, np.eye(len(z)), -float(there.value), 1, 0.0)


def at_values(problem, **values: float) -> np.ndarray:
    """z of a point, the rest at their medians."""
    z = np.zeros(problem.parameters.size)
    for label, value in values.items():
        law = problem.parameters.sampled[problem.parameters.index(label)].prior
        z[problem.parameters.index(label)] = np.log(value / law.median) / np.log(law.factor)
    return z


@pytest.mark.parametrize(("many", "ok"), [(0, True), (3, True), (9, False)])
def test_a_search_may_miss_one_campaign_in_fifty_beyond_chance(many, ok):
    rng = np.random.default_rng(8)
    rows = [row_of(i, rng, False, float(rng.uniform())) for i in range(100)]
    for i, row in enumerate(rows):
        row["value"]["missed"] = 5.5 if i < many else 0.0
    check = next(c for c in verdict(Design(1), rows).checks if c.name == "search")
    assert check.ok == ok
    assert f"in {many} of 100" in check.says
