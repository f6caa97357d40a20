"""Joint log-posterior of the campaign, by walker, against the same with SciPy's LSODA."""

import functools
import statistics
import time
from dataclasses import dataclass

import numpy as np
from campaign import Bench
from lsoda import ATOL, RTOL, LsodaPosterior
from table import Row, ratio_row

from rigid.likelihood.problem import log_density

TIGHT = 1e-10
LOOSE = 1e-4
AGREE = 0.1
"""Log-posteriors closer than this are the same (issue's bar for the fast ways)."""


@dataclass(frozen=True)
class Peer:
    """LSODA at points of the posterior: seconds an evaluation, and how far it is from rigid."""

    seconds: float
    solving: float
    difference: float


@functools.cache
def lsoda(bench: Bench, rtol: float = RTOL, atol: float = ATOL) -> Peer:
    """Time LSODA one walker at a time, its likelihood included; compare it with rigid."""
    z = bench.draws(bench.choose(3, 12))
    ours = log_density(bench.problem, z)
    posterior = LsodaPosterior(bench.problem, rtol, atol)
    posterior(z[0])  # compiles the likelihood
    times, solving, values = [], [], []
    for point in z:
        posterior.solving, began = 0.0, time.perf_counter()
        values.append(posterior(point))
        times.append(time.perf_counter() - began)
        solving.append(posterior.solving)
    difference = float(np.abs(np.array(values) - ours).max())
    return Peer(statistics.median(times), statistics.median(solving), difference)


def rows(bench: Bench) -> list[Row]:
    """The ratio, and whether both cores are in use."""
    ours, theirs = bench.speed, lsoda(bench)
    tight, loose = lsoda(bench, TIGHT, TIGHT), lsoda(bench, LOOSE, LOOSE)
    agreement = (
        f"largest difference of the two log-posteriors at {bench.choose(3, 12)} points of the "
        f"posterior: {theirs.difference:.3g}; with LSODA at {TIGHT:g}: {tight.difference:.3g}; "
        f"at {LOOSE:g}: {loose.difference:.3g}"
    )
    first = ratio_row(
        ("joint log-posterior of the reference campaign, per walker", "SciPy LSODA (`odeint`)"),
        theirs.seconds / ours.per_walker,
        300.0,
        f"rigid {1e3 * ours.per_walker:.3g} ms a walker: batches of {bench.half} walkers, a thread "
        "a core",
        f"LSODA {1e3 * theirs.seconds:.3g} ms, of which {1e3 * theirs.solving:.3g} ms in the "
        f"solver and the rest in rigid's likelihood; rtol {RTOL:g}, atol {ATOL:g} typical sizes; "
        f"{1e3 * tight.seconds:.3g} ms at {TIGHT:g}, {1e3 * loose.seconds:.3g} ms at {LOOSE:g}",
        "LSODA gets its rates from plain Python floats and restarts at every switch of the valve",
        agreement,
    )
    both = Row(
        "log-posterior, processor time over wall time",
        "one core",
        f"{ours.cores_used:.2f}",
        "1.6",
        ours.cores_used >= 1.6,
        ("means something on an idle machine only",),
    )
    same = Row(
        "log-posterior, difference from LSODA at 1e-10",
        "LSODA, points of the posterior",
        f"{tight.difference:.3g}",
        f"below {AGREE:g}",
        tight.difference < AGREE,
    )
    return [first, both, same]
