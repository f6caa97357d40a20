"""Weighted draws of a posterior with all that is ranked among them.

Of the law over the modes where their weights do; else each of a conditional mode of its own; else
those of a chain.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from rigid.inference.adaptation import drawn
from rigid.inference.nested import nested
from rigid.inference.posterior import stack
from rigid.inference.proposal import UNRELIABLE, kish, pareto_shape
from rigid.inference.sample import Draws, Settings, sample
from rigid.inference.sampling import covers
from rigid.inference.search_cache import Searched
from rigid.likelihood.problem import (
    Problem,
    evaluate,
    in_batches,
    log_density,
    log_posterior,
    walkers,
)

ESS = 200.0
"""Independent draws that weighted ones are to be worth: a rank then is known to 0.035 or better,
which adds less than 2 % to the variance that ranks have from campaign to campaign (1/12)."""
BATCH, MOST_DRAWS = 2048, 12_288
SLICES, MOST_SLICES = 200, 2400
"""Draws at conditional modes of their own in a lot, and at most."""
ENSEMBLES, CHAIN_BLOCK, CHAIN_STEPS, R_HAT = 2, 50, 3000, 1.02
"""Of a chain that takes over where weights do not do: the fewest ensembles that R-hat compares, one
of which begins apart, and a limit that means of ESS draws can keep. What such chains still miss
stands in docs/studies/validation-notes.md."""
KEPT_STEPS = 20
"""Steps of each walker of a chain that ranks are taken among, as many as posterior.nc holds."""


WEIGHTS, SLICED, CHAIN = BY = ("weights", "conditional modes", "chain")
"""Ways to draw."""


@dataclass(frozen=True, eq=False)
class Weighted:
    """Draws of a posterior.

    - `z` (n, size), `weight` (n,), `log_posterior` (n,).
    - `sensors`: by label, (5, n): mean of gain and zero, variance of the gain, covariance, variance
      of the zero, given z.
    - `pareto_k`: shape of the weights' tail; None where all weigh the same, as those of a chain.
    - `by`: how they were drawn, one of BY. - `settled`: whether a chain has met its stopping rule,
      begun in a law that covers the posterior.
    """

    z: np.ndarray
    weight: np.ndarray
    log_posterior: np.ndarray
    sensors: Mapping[str, np.ndarray]
    pareto_k: float | None
    by: str = WEIGHTS
    settled: bool = True

    @property
    def ess(self) -> float:
        """Independent draws that the weights are worth."""
        return kish(self.weight)

    @property
    def good(self) -> bool:
        """Whether sums over the draws can be trusted."""
        told = self.pareto_k is None or self.pareto_k < UNRELIABLE
        return self.settled and self.ess >= ESS and told

    @property
    def mean(self) -> np.ndarray:
        """Mean of z (size,)."""
        return self.weight @ self.z / self.weight.sum()

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of z (size, size)."""
        away = self.z - self.mean
        return (away * self.weight[:, None]).T @ away / self.weight.sum()


def evaluated(problem: Problem, z: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Log-posterior (n,) and law of every sensor (5, n) at z (n, size)."""
    parts = in_batches(evaluate, problem, z)
    value = np.concatenate([p.log_posterior[:n] for p, n in parts])
    labels = parts[0][0].sensors
    return value, {
        label: np.concatenate([p.sensors[label][:, :n] for p, n in parts], axis=1)
        for label in labels
    }


def weighted(known: Searched, rng: np.random.Generator) -> Weighted:
    """Draw of the law over the modes until the weights are worth ESS draws, and reliable."""
    problem, chart = known.found.problem, known.chart
    parts: list[tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]] = []
    logs: list[np.ndarray] = []

    def density(z: np.ndarray) -> np.ndarray:
        value, sensors = evaluated(problem, z)
        parts.append((z, value, sensors))
        return value

    while True:
        logs.append(drawn(chart.density(density), known.law, rng, BATCH).log_weight)
        found = _together(parts, np.concatenate(logs))
        if found.good or len(found.weight) >= MOST_DRAWS:
            return found


def _together(parts: list, log_weight: np.ndarray) -> Weighted:
    some = np.any(np.isfinite(log_weight))
    weight = np.exp(log_weight - log_weight.max()) if some else np.zeros(len(log_weight))
    usable = weight > 0.0
    sensors = {
        label: np.concatenate([p[2][label] for p in parts], axis=1)[:, usable]
        for label in parts[0][2]
    }
    return Weighted(
        np.concatenate([p[0] for p in parts])[usable],
        weight[usable],
        np.concatenate([p[1] for p in parts])[usable],
        sensors,
        float(pareto_shape(weight)) if some else np.inf,
    )


def sliced(known: Searched, rng: np.random.Generator) -> Weighted | None:
    """Draw at conditional modes; None where the posterior is not one ridge."""
    problem, chart = known.found.problem, known.chart
    law = nested(known.found, chart, known.weights.weights, rng)
    if law is None:
        return None
    density = chart.density(lambda z: log_density(problem, z))
    z, logs = np.empty((0, problem.parameters.size)), np.empty(0)
    while True:
        fresh = law.drawn(density, rng, SLICES)
        z = np.concatenate([z, chart.standard(fresh.z)])
        logs = np.concatenate([logs, fresh.log_weight])
        usable = np.isfinite(logs)
        weight = np.exp(logs[usable] - logs.max()) if usable.any() else np.zeros(0)
        if not usable.any() or kish(weight) >= ESS or len(logs) >= MOST_SLICES:
            break
    value, sensors = evaluated(problem, z[usable])
    shape = float(pareto_shape(weight)) if usable.any() else np.inf
    return Weighted(z[usable], weight, value, sensors, shape, SLICED)


def chained(known: Searched, seed: int) -> Weighted:
    """Draws of a short chain, whose walkers take most of their steps from the law over the modes.

    It ends once its draws are worth ESS. Where that law does not cover the posterior they are not
    to be trusted, as in a fit (check `covered`).
    """
    problem, chart = known.found.problem, known.chart
    settings = Settings(
        ensembles=ENSEMBLES,
        walkers=walkers(problem),
        block=CHAIN_BLOCK,
        max_steps=CHAIN_STEPS,
        r_hat=R_HAT,
        ess=ESS,
        seed=seed,
    )
    density = chart.density(lambda z: np.asarray(log_posterior(problem, jnp.asarray(z))))
    found = sample(density, known.law, settings)
    usable = found.converged and covers(known)
    return of_chain(
        problem, dataclasses.replace(found, z=chart.standard(found.z), converged=usable)
    )


def of_chain(problem: Problem, draws: Draws) -> Weighted:
    """Some draws of a chain, in z, as weighted ones, all of the same weight."""
    chain = stack(draws.thinned(KEPT_STEPS).z)
    z = chain.reshape(-1, chain.shape[-1])
    value, sensors = evaluated(problem, z)
    return Weighted(z, np.ones(len(z)), value, sensors, None, CHAIN, draws.converged)
