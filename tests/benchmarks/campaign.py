"""The reference campaign as every row meets it: problem, search, points of its posterior."""

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from rigid.inference.calibrate import propose
from rigid.inference.sample import cores
from rigid.inference.search import Found, search
from rigid.inference.search_cache import Searched
from rigid.likelihood.assemble import assemble
from rigid.likelihood.problem import Problem, log_posterior, walkers
from rigid.records.read import read_records
from rigid.spec import Spec, load_spec

ROOT = Path(__file__).resolve().parents[2]
SPEC = ROOT / "fits" / "calibration.toml"
SEED = 1
BATCHES_A_CORE = 3


@dataclass(frozen=True, eq=False)
class Bench:
    """What the rows share. `quick`: fewer repetitions; `out`: where plots go, or None."""

    quick: bool
    out: Path | None = None

    def choose(self, quick: int, full: int) -> int:
        """One of two sizes."""
        return quick if self.quick else full

    @property
    def runs(self) -> int:
        """Repetitions of which the median is taken."""
        return self.choose(3, 7)

    @cached_property
    def spec(self) -> Spec:
        """The spec of the reference campaign."""
        return load_spec(SPEC)

    @cached_property
    def plain(self) -> Problem:
        """Its problem before any search."""
        return assemble(self.spec, read_records(self.spec))

    @cached_property
    def found(self) -> Found:
        """Modes of the posterior, and the problem with weights for correlated residuals."""
        return search(self.plain, self.choose(2, self.spec.sampler.starts), SEED)

    @cached_property
    def search_seconds(self) -> float:
        """Wall time of the search once its programs are compiled: evaluations with derivatives."""
        starts = self.found.starts
        began = time.perf_counter()
        search(self.plain, starts, SEED)
        return time.perf_counter() - began

    @property
    def problem(self) -> Problem:
        """The problem that is sampled."""
        return self.found.problem

    @cached_property
    def known(self) -> Searched:
        """The mixture that the fit lays over the modes, and its coordinates."""
        return propose(self.found, np.random.default_rng([SEED, 1]))

    def draws(self, count: int) -> np.ndarray:
        """Points z (count, size) as walkers visit them, from the mixture over the modes."""
        return self.known.chart.standard(self.known.law.sample(np.random.RandomState(SEED), count))

    @cached_property
    def speed(self) -> "Speed":
        """Cost of the joint log-posterior, all cores in use."""
        return batched(self.problem, self.draws(self.half * BATCHES_A_CORE * cores()), self.runs)

    @property
    def half(self) -> int:
        """Walkers in one batch: half an ensemble, as the sampler asks for them."""
        return walkers(self.problem) // 2


@dataclass(frozen=True)
class Speed:
    """Wall seconds for each walker, and processor time over wall time."""

    per_walker: float
    cores_used: float


def median_time(work: Callable[[], object], runs: int) -> float:
    """Median wall time of `work` over `runs` runs, after one that is not counted."""
    work()
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def batched(problem: Problem, z: np.ndarray, runs: int) -> Speed:
    """Time `log_posterior` on z in batches, a thread a core, as the sampler calls it."""
    half = walkers(problem) // 2
    batches = [jnp.asarray(z[i : i + half]) for i in range(0, len(z), half)]

    def one(batch: jnp.ndarray) -> None:
        log_posterior(problem, batch).block_until_ready()

    one(batches[0])
    walls, used = [], []
    with ThreadPoolExecutor(cores()) as pool:
        for _ in range(runs + 1):
            began, busy = time.perf_counter(), time.process_time()
            list(pool.map(one, batches))
            walls.append(time.perf_counter() - began)
            used.append((time.process_time() - busy) / walls[-1])
    return Speed(statistics.median(walls[1:]) / len(z), statistics.median(used[1:]))
