"""How a posterior is drawn: by walkers, or by weighted draws where these do better."""

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from rigid.inference.adaptation import drawn
from rigid.inference.checkpoint import Checkpoint
from rigid.inference.coordinates import Chart
from rigid.inference.derived import frictions, values_of
from rigid.inference.friction_curve import FREQUENCIES
from rigid.inference.importance import Draw, weighed
from rigid.inference.nested import TRIED, nested
from rigid.inference.sample import Draws, Monitor, Settings, Status, sample
from rigid.inference.search_cache import Searched
from rigid.io.cache import Shelf
from rigid.io.cli import Options
from rigid.io.progress import stage
from rigid.likelihood.problem import Problem, log_density, log_posterior, walkers
from rigid.spec.values import SamplerSpec

LEAST_SHARE, FINITE = 0.1, 0.5
"""Share of effective draws of the law over the modes from which on it covers the posterior, and the
Pareto shape below which weights have a variance. Below that share it misses a part of the ridge: a
chain that begins in it agrees with itself alone (docs/studies/validation-notes.md)."""
MOST_OVERLOOKED = 0.1
"""Share of the posterior around conditional modes that the law may overlook."""
NAME = "weighted"
STREAM = 4
"""Number of this part of a fit among those that draw from its seed."""
EACH, EACH_AT_MODES = 256, 64
"""Draws of a lot in a round: of the law over the modes, at conditional modes of their own."""


class Kept(NamedTuple):
    """What a folder keeps of draws: weighted ones when they are done, a chain block by block."""

    weighted: Shelf
    chain: Checkpoint


def sampled(rule: SamplerSpec, known: Searched, run: tuple[int, Options], kept: Kept) -> Draws:
    """Draw from a posterior under a spec's stopping rule, in z.

    - `run`: seed and options. - `kept`: what a run that goes on begins with.
    """
    seed, options = run
    problem, chart = known.found.problem, known.chart
    settings = Settings(
        ensembles=rule.ensembles,
        walkers=rule.walkers or walkers(problem),
        block=rule.block,
        max_steps=rule.max_steps,
        r_hat=rule.r_hat,
        ess=rule.ess,
        seed=seed,
    )
    monitor = partial(_monitored, problem, chart)
    found = None if rule.method == "emcee" else kept.weighted.read(NAME, (Draws,))
    if found is None:
        ways = _weighted_ways(rule, known, seed)
        tried = (_weighed(way, settings, monitor, options.quiet) for way in ways)
        found = next((draws for draws in tried if draws is not None), None)
        if found is not None:
            kept.weighted.put(NAME, found)
    if found is None:
        found = _walked(known, settings, monitor, (kept.chain, options))
    return dataclasses.replace(found, z=chart.standard(found.z))


def covers(known: Searched) -> bool:
    """Whether the law over the modes covers the posterior."""
    return known.weights.kish > LEAST_SHARE and known.overlooked < MOST_OVERLOOKED


class Way(NamedTuple):
    """One way to make weighted draws.

    - `title`: for whoever waits. - `ready`: makes what draws; None where there is nothing to draw
      of. - `each`: draws of a lot in a round. - `evaluations`: of the posterior, a draw.
    """

    title: str
    ready: Callable[[], Draw | None]
    each: int
    evaluations: int


def _weighted_ways(rule: SamplerSpec, known: Searched, seed: int) -> Iterator[Way]:
    """Ways of weighted draws that may do."""
    if rule.method == "emcee":
        return
    density = known.chart.density(lambda z: log_density(known.found.problem, z))

    def of_law() -> Draw:
        return lambda rng, draws: drawn(density, known.law, rng, draws)

    def at_modes() -> Draw | None:
        rng = np.random.default_rng([seed, STREAM])
        law = nested(known.found, known.chart, known.weights.weights, rng)
        return None if law is None else partial(law.drawn, density)

    if covers(known) and known.weights.pareto_k < FINITE:
        yield Way("sample by weights", of_law, EACH, 1)
    if not covers(known):
        yield Way("sample along the ridge", at_modes, EACH_AT_MODES, TRIED)


def _weighed(way: Way, settings: Settings, monitor: Monitor, quiet: bool) -> Draws | None:
    """Weigh draws until they do; how far they are is their least ESS."""
    with stage(quiet, way.title, int(settings.ess), "least ESS") as shown:
        draw = way.ready()
        if draw is None:
            return None
        found = weighed(
            draw,
            way.each,
            settings,
            monitor,
            lambda far: shown.reach(int(far.ess), f"{far.draws} draws"),
        )
    if found is None:
        return None
    return dataclasses.replace(found, evaluations=found.evaluations * way.evaluations)


def _walked(
    known: Searched, settings: Settings, monitor: Monitor, run: tuple[Checkpoint, Options]
) -> Draws:
    """Run ensembles of walkers; how far they are is their least ESS."""
    checkpoint, options = run
    problem = known.found.problem
    density = known.chart.density(lambda z: np.asarray(log_posterior(problem, jnp.asarray(z))))
    with stage(options.quiet, "sample", int(settings.ess), "least ESS") as shown:

        def report(status: Status) -> None:
            steps = f"{status.steps} steps"
            if status.ess is None:
                shown.reach(0, steps)
            else:
                r_hat = f"R-hat {status.r_hat:.3f} of {status.r_hat_name} (limit {settings.r_hat})"
                shown.reach(int(status.ess), f"{steps}, {r_hat}")

        return sample(density, known.law, settings, monitor, checkpoint, report)


def _monitored(problem: Problem, chart: Chart, u: np.ndarray) -> dict[str, np.ndarray]:
    """What must have converged, (n,) each: parameters, sums, |mu| at both ends of its range."""
    release = int(np.argmin(abs(FREQUENCIES - 80.0)))
    z = chart.standard(u)
    views = frictions(problem, values_of(problem, z))
    summed = zip(chart.names, chart.summed(z).T, strict=True)
    return (
        dict(zip(problem.parameters.labels, z.T, strict=True))
        | dict(summed)
        | {
            f"|mu| at {frequency:g} Hz {label}".strip(): view.magnitude[:, at]
            for label, view in views.items()
            for frequency, at in ((0.01, 0), (80.0, release))
        }
    )
