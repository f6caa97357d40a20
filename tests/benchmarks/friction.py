"""Joint log-posterior of the campaign with dry friction, against the same with SciPy's LSODA."""

import dataclasses
import statistics
import time

import numpy as np
from campaign import SEED, Bench, batched
from lsoda import ATOL, RTOL, LsodaPosterior
from table import Row, ratio_row

from rigid.likelihood.assemble import assemble
from rigid.likelihood.problem import Problem, log_density
from rigid.records.read import read_records

LAWS = {
    "Coulomb": "coulomb-friction",
    "Stribeck": "stribeck-friction",
    "LuGre": "lugre-friction",
}
MEMORY = "frequency-dependent-friction"
TIGHT = 1e-9
BAR, BAR_WITH_REASONS = 30.0, 10.0


def with_law(bench: Bench, effect: str) -> Problem:
    """The reference campaign with a law of dry friction in the place of that with memory."""
    kept = [name for name in bench.spec.model.effects if name != MEMORY]
    model = bench.spec.model.model_copy(update={"effects": (*kept, effect)})
    spec = bench.spec.model_copy(update={"model": model})
    return assemble(spec, read_records(spec))


def points(bench: Bench, problem: Problem, count: int) -> np.ndarray:
    """Points z (count, size): the friction from its prior, all else as the posterior has it."""
    z = np.random.default_rng(SEED).standard_normal((count, problem.parameters.size))
    drawn, known = bench.draws(count), bench.problem.parameters.labels
    for i, label in enumerate(problem.parameters.labels):
        if label in known and label != "mu":
            z[:, i] = drawn[:, known.index(label)]
    return z


def rows(bench: Bench) -> list[Row]:
    """A row for each law."""
    return [_row(bench, name, with_law(bench, effect)) for name, effect in LAWS.items()]


def _row(bench: Bench, name: str, problem: Problem) -> Row:
    z = points(bench, problem, bench.half * 2)
    ours = batched(problem, z, bench.choose(1, 3))
    few = z[: bench.choose(2, 8)]
    theirs, seconds = _by_lsoda(problem, few, RTOL, ATOL)
    tight, _ = _by_lsoda(problem, few, TIGHT, TIGHT)
    values = log_density(problem, few)
    off, own_off = np.abs(values - tight), np.abs(theirs - tight)
    row = ratio_row(
        (f"joint log-posterior with {name} friction", "SciPy LSODA (`odeint`)"),
        seconds / ours.per_walker,
        BAR,
        f"rigid {1e3 * ours.per_walker:.3g} ms a walker, both cores; LSODA {1e3 * seconds:.4g} ms; "
        f"the friction from its prior, all else from the posterior of the calibration",
        f"difference from LSODA at {TIGHT:g}, at {len(few)} points, median and largest: "
        f"{np.median(off):.3g}, {off.max():.3g}; of LSODA at {RTOL:g} {np.median(own_off):.3g}, "
        f"{own_off.max():.3g}; the log-posteriors themselves are about {np.median(tight):.4g}",
    )
    return dataclasses.replace(row, bar=f"{BAR:g} times ({BAR_WITH_REASONS:g} with reasons)")


def _by_lsoda(
    problem: Problem, z: np.ndarray, rtol: float, atol: float
) -> tuple[np.ndarray, float]:
    """Log-posteriors at z, and the median of the seconds that one takes."""
    posterior = LsodaPosterior(problem, rtol, atol)
    posterior(z[0])  # compiles the likelihood
    values, times = [], []
    for point in z:
        began = time.perf_counter()
        values.append(posterior(point))
        times.append(time.perf_counter() - began)
    return np.array(values), statistics.median(times)
