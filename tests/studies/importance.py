"""Weighted draws of a posterior, as many as its sums need."""

from typing import NamedTuple

import numpy as np

from rigid.inference.adaptation import drawn
from rigid.inference.proposal import UNRELIABLE, kish, pareto_shape
from rigid.inference.search_cache import Searched
from rigid.likelihood.problem import log_density

ESS = 500.0
BATCH, MOST_DRAWS = 2048, 12_288


class Drawn(NamedTuple):
    """Draws of the posterior (n, size), their weights (n,), and whether they can be trusted."""

    z: np.ndarray
    weight: np.ndarray
    good: bool


def weighted(known: Searched, rng: np.random.Generator) -> Drawn:
    """Draw of a law until the weights are worth ESS independent draws, and reliable."""
    chart = known.chart
    density = chart.density(lambda z: log_density(known.found.problem, z))
    draws, logs = [], []
    while True:
        fresh = drawn(density, known.law, rng, BATCH)
        draws.append(chart.standard(fresh.z))
        logs.append(fresh.log_weight)
        every = np.concatenate(logs)
        weight = np.exp(every - every.max())
        good = kish(weight) >= ESS and pareto_shape(weight) < UNRELIABLE
        if good or len(weight) >= MOST_DRAWS:
            return Drawn(np.concatenate(draws), weight, good)
