"""What the two large programs of a fit take to compile: the log-posterior, and its expansion."""

import statistics
import time
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from campaign import Bench
from jax.experimental.compilation_cache import compilation_cache
from table import Row

from rigid.inference.newton import is_noise, joined, local
from rigid.likelihood.problem import walkers


def core_seconds(program: Callable, *given, runs: int) -> float:
    """Processor time of tracing and compiling, the median of several times, nothing kept."""
    took = []
    jax.config.update("jax_enable_compilation_cache", False)
    compilation_cache.reset_cache()  # JAX asks once a process whether programs are kept
    try:
        for _ in range(runs):
            jax.clear_caches()
            began = time.process_time()
            jax.jit(program).lower(*given).compile()
            took.append(time.process_time() - began)
    finally:
        jax.config.update("jax_enable_compilation_cache", True)
        compilation_cache.reset_cache()
    return statistics.median(took)


def rows(bench: Bench) -> list[Row]:
    problem, runs = bench.plain, bench.choose(1, 3)
    arrays, rest = eqx.partition(problem, eqx.is_array)
    size = problem.parameters.size
    z = jnp.zeros((walkers(problem) // 2, size))
    w = joined(problem, np.zeros(size), np.zeros((len(problem.sensors), 2)))
    levels = jnp.zeros(int(is_noise(problem).sum()))

    def density(arrays, z):
        return eqx.combine(arrays, rest).evaluate(z)

    def expansion(arrays, w, levels):
        return local(eqx.combine(arrays, rest), w, levels)

    taken = (
        core_seconds(density, arrays, z, runs=runs),
        core_seconds(expansion, arrays, jnp.asarray(w), levels, runs=runs),
    )
    note = (
        f"**Compiling.** Processor time to trace and compile, median of {runs}: "
        f"{taken[0]:.1f} s the log-posterior, {taken[1]:.1f} s its expansion by all parameters."
    )
    told = f"{taken[0]:.1f} and {taken[1]:.1f} core-s"
    sides = "compiling the log-posterior, and its expansion", "nothing"
    return [Row(*sides, told, "-", None, (note,))]
