"""Wall time of the whole command against the time it spends in likelihood evaluations."""

import functools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from campaign import ROOT, SPEC, Bench
from table import Row

from rigid.inference.calibrate import KEPT_STEPS, MODE_DRAWS
from rigid.likelihood.problem import walkers

LIGHT = "\n[sampler]\nstarts = 2\nr_hat = 1.1\ness = 200\nblock = 50\n"
"""Settings of a quick run."""


@dataclass(frozen=True)
class Fit:
    """What one run of the command took: its own wall time, evaluations and least ESS."""

    wall: float
    evaluations: int
    ess: float
    status: int


@dataclass(frozen=True)
class Fits:
    """Cold and warm runs."""

    cold: Fit
    warm: tuple[Fit, ...]

    @property
    def warm_wall(self) -> float:
        """Median wall time with the cache warm."""
        return statistics.median(f.wall for f in self.warm)


def fitted(spec: Path, folder: Path, cache: Path) -> Fit:
    """Run the command once in a process of its own."""
    command = (sys.executable, "-m", "rigid.fit", spec, "--out", folder, "--quiet")
    given = os.environ | {"RIGID_CACHE": str(cache)}
    given.pop("OPENBLAS_NUM_THREADS", None)  # the command as its user calls it
    began = time.perf_counter()
    done = subprocess.run(command, cwd=ROOT, env=given, capture_output=True)
    wall = time.perf_counter() - began
    if done.returncode not in (0, 1):
        raise RuntimeError(done.stderr.decode())
    cost = json.loads((folder / "result.json").read_text("utf-8"))["cost"]
    return Fit(wall, cost["evaluations"], cost["ess_min"] or 0.0, done.returncode)


@functools.cache
def fits(bench: Bench) -> Fits:
    """Run the command with an empty cache, then with a full one."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        spec = folder / SPEC.name
        text = SPEC.read_text("utf-8").replace('"../data/', f'"{ROOT}/data/')
        spec.write_text(text + (LIGHT if bench.quick else ""), "utf-8")
        cache = folder / "cache"
        cold = fitted(spec, folder / "cold", cache)
        runs = range(bench.choose(1, 3))
        return Fits(cold, tuple(fitted(spec, folder / f"warm-{i}", cache) for i in runs))


def rows(bench: Bench) -> list[Row]:
    """Warm and cold."""
    found = fits(bench)
    per_walker = bench.speed.per_walker
    chain = found.cold.evaluations * per_walker
    drawn = 2 * len(bench.found.optima) * MODE_DRAWS
    told = bench.spec.sampler.ensembles * walkers(bench.problem) * KEPT_STEPS
    likelihood = chain + (drawn + told) * per_walker + bench.search_seconds
    bar = 3.0 * likelihood + 5.0
    notes = (
        f"{found.cold.evaluations} evaluations of the chain at {1e3 * per_walker:.3g} ms a walker "
        f"make {chain:.3g} s, {drawn} for the proposal and {told} of what is told "
        f"{(drawn + told) * per_walker:.3g} s, the search's, with derivatives, "
        f"{bench.search_seconds:.3g} s; against the chain's alone the command takes "
        f"{found.warm_wall / chain:.2g} times as long warm, {found.cold.wall / chain:.2g} cold",
        f"least ESS {found.cold.ess:.0f}, status {found.cold.status}",
    )
    sides = "wall time of `python -m rigid.fit calibration`", "time in likelihood evaluations"
    return [
        Row(
            f"{sides[0]}, cache {name}",
            sides[1],
            f"{wall:.3g} s against {likelihood:.3g} s ({wall / likelihood:.2g} times)",
            f"{word} = {limit:.3g} s",
            wall <= limit,
            notes,
        )
        for name, wall, limit, word in (
            ("warm", found.warm_wall, bar, "3 times + 5 s"),
            ("cold", found.cold.wall, bar + 30.0, "3 times + 35 s"),
        )
    ]
