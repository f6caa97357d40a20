"""emcee with SciPy's LSODA, as its documentation advises: stretch moves, a pool of processes."""

import logging
import multiprocessing
import time
from dataclasses import dataclass

import emcee
import numpy as np
from campaign import Bench
from lsoda import LsodaPosterior

from rigid.inference.sample import cores
from rigid.likelihood.problem import log_density, walkers

_WORKER: list[LsodaPosterior] = []


@dataclass(frozen=True)
class Emcee:
    """`tau`: steps an independent draw takes, of `steps`; `seconds`: wall time an evaluation."""

    tau: float
    steps: int
    seconds: float
    evaluations: int

    @property
    def ess_per_second(self) -> float:
        """Effective samples per second: a walker's step is an evaluation."""
        return 1.0 / (self.tau * self.seconds)


def measured(bench: Bench) -> Emcee:
    """Autocorrelation time from a long chain on rigid's likelihood, cost from LSODA's own run."""
    steps = bench.choose(150, 5000)
    tau = autocorrelation(bench, steps)
    seconds, evaluations = shortened(bench, bench.choose(1, 3))
    return Emcee(tau, steps, seconds, evaluations)


def autocorrelation(bench: Bench, steps: int) -> float:
    """Longest integrated autocorrelation time of any parameter, in steps, by emcee's estimator."""
    n, d = walkers(bench.problem), bench.problem.parameters.size
    sampler = emcee.EnsembleSampler(n, d, lambda z: log_density(bench.problem, z), vectorize=True)
    sampler.run_mcmc(bench.draws(n), steps)
    logging.getLogger("emcee").setLevel(logging.ERROR)  # the note says how long the chain was
    return float(np.max(sampler.get_autocorr_time(discard=steps // 4, tol=0, quiet=True)))


def shortened(bench: Bench, steps: int) -> tuple[float, int]:
    """Wall seconds an evaluation with a process a core, over a few steps; how many there were."""
    n, d = walkers(bench.problem), bench.problem.parameters.size
    weights = {(p.group, p.quantity): np.asarray(p.weight) for p in bench.problem.pieces}
    start = emcee.State(bench.draws(n), log_prob=log_density(bench.problem, bench.draws(n)))
    context = multiprocessing.get_context("spawn")  # JAX's threads do not survive a fork
    with context.Pool(cores(), initializer=_prepare, initargs=(weights,)) as pool:
        pool.map(_evaluate, list(bench.draws(2 * cores())))  # until all have compiled
        sampler = emcee.EnsembleSampler(n, d, _evaluate, pool=pool)
        began = time.perf_counter()
        sampler.run_mcmc(start, steps)
        wall = time.perf_counter() - began
    return wall / (n * steps), n * steps


def _prepare(weights: dict[tuple[int, str], np.ndarray]) -> None:
    """Make the posterior of a worker."""
    from rigid.io.runtime import prepare

    prepare()
    _WORKER.append(LsodaPosterior(Bench(quick=True).plain.with_weights(weights)))


def _evaluate(z: np.ndarray) -> float:
    value = _WORKER[0](z)
    return value if np.isfinite(value) else -np.inf
