"""How far programs and commands are from what one core can do: arithmetic, memory, exponentials.

What a simulation takes at least is counted by hand: the state of a rig is known some samples
before, and a reading is the product of a row of numbers with it, whatever the oil and the pump do.
What is simulated, expanded and weighed is counted while a command runs.
"""

import statistics
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest import mock

import jax
import jax.numpy as jnp
import numpy as np
from campaign import Bench, median_time
from table import Row
from wait import HIDDEN, generated

from rigid.inference import derived, newton, pointwise, reference_check, scores
from rigid.inference.newton import is_noise, joined, local
from rigid.inference.tangents import tangents
from rigid.likelihood import problem
from rigid.likelihood.problem import Problem, log_posterior
from rigid.localfit import families
from rigid.study.study import load

STATES = 7
"""Of a rig with two branches of friction: two positions and speeds, a pressure, two forces."""
OF_A_SUM = 2
"""Operations of a product that is added to a sum."""
OF_A_READING = 4
"""Operations of a Gaussian density: difference, quotient, square, sum."""
OF_A_SENSOR = 2
"""Numbers of a sensor, its gain and zero, by which a reading is expanded as well."""
NUMBER = np.dtype(float).itemsize


@dataclass(frozen=True)
class Work:
    """What is asked of a core.

    - `operations`: additions and products. - `exponentials`: and their like. - `bytes`: read or
      written; what lies between may stay in the core.
    """

    operations: float = 0.0
    exponentials: float = 0.0
    bytes: float = 0.0

    def __add__(self, other: "Work") -> "Work":
        return Work(
            self.operations + other.operations,
            self.exponentials + other.exponentials,
            self.bytes + other.bytes,
        )

    def times(self, often: float) -> "Work":
        """The same work so often."""
        return Work(often * self.operations, often * self.exponentials, often * self.bytes)


@dataclass(frozen=True)
class Core:
    """Rates of one core [1/s], each the best that a library reaches."""

    operations: float
    exponentials: float
    bytes: float

    def least(self, work: Work) -> float:
        """Seconds that work takes at least; memory may be busy beside arithmetic."""
        counted = work.operations / self.operations + work.exponentials / self.exponentials
        return max(counted, work.bytes / self.bytes)


def measured(runs: int) -> Core:
    """Rates of this machine's core: a product of matrices, exponentials in cache, a copy."""
    square = np.random.default_rng(0).standard_normal((1024, 1024))
    few, out = np.linspace(-1.0, 1.0, 4096), np.empty(4096)
    long = np.zeros(2**25)
    into = np.ones_like(long)
    product = median_time(lambda: square @ square, runs)
    exponential = median_time(lambda: [np.exp(few, out=out) for _ in range(64)], runs)
    copy = median_time(lambda: np.copyto(into, long), runs)
    return Core(
        OF_A_SUM * 1024**3 / product,
        64 * len(few) / exponential,
        2 * long.nbytes / copy,
    )


def simulated(readings: float, states: int = STATES, slopes: int = 0) -> Work:
    """Readings of one simulation, and how they change along some directions."""
    numbers = readings * (1 + slopes)
    return Work(numbers * OF_A_SUM * states, 0.0, numbers * NUMBER)


def weighed(readings: float) -> Work:
    """Their likelihood: an exponential each, as a converter asks for, beside the data's bytes."""
    return Work(readings * OF_A_READING, readings, readings * NUMBER)


def evaluated(asked: Problem) -> Work:
    """One log-posterior."""
    readings = readings_of(asked)
    return simulated(readings) + weighed(readings)


def expanded(asked: Problem) -> Work:
    """One log-posterior with slopes and information: products of all slopes of a reading."""
    along = len(tangents(asked, np.flatnonzero(~is_noise(asked))).along)
    slopes, readings = along + OF_A_SENSOR, readings_of(asked)
    products = Work(readings * OF_A_SUM * (slopes + slopes * (slopes + 1) / 2))
    return simulated(readings, slopes=along) + weighed(readings) + products


def readings_of(asked: Problem) -> float:
    """Samples that count, of all channels."""
    return sum(float(np.sum(np.asarray(piece.weight) > 0)) for piece in asked.pieces)


class Ledger:
    """What a command asks of a core while it runs, at the least.

    - `work`: so far. - `runs`: by what was run.
    """

    def __init__(self) -> None:
        self.work = Work()
        self.runs: dict[str, float] = {}
        self._lock = threading.Lock()

    def add(self, what: str, work: Work, often: float = 1.0) -> None:
        """Book some runs of what takes so much work."""
        with self._lock:
            self.work += work.times(often)
            self.runs[what] = self.runs.get(what, 0.0) + often

    def evaluate(self, run: Callable) -> Callable:
        """`problem.evaluate`, booked."""

        def each(asked: Problem, z: jax.Array) -> Any:
            self.add("log-posteriors", evaluated(asked), len(z))
            return run(asked, z)

        return each

    def in_batches(self, run: Callable) -> Callable:
        """`in_batches`, booked: log-posteriors are booked where they are evaluated."""

        def each(program: Callable, asked: Problem, z: np.ndarray) -> Any:
            if program is not log_posterior:
                self.add("simulations", simulated(readings_of(asked)), len(z))
            return run(program, asked, z)

        return each

    def led(self, run: Callable) -> Callable:
        """A descent of a search, booked: an expansion a step."""

        def lead(asked: Any, w: jax.Array) -> tuple:
            found = run(asked, w)
            self.add("expansions", expanded(asked[0]), float(found[2]) + 1.0)
            return found

        lead.lower = run.lower  # type: ignore[attr-defined]
        return lead

    def lanes(self, slopes: int) -> Callable[[Callable], Callable]:
        """A program of discovery, booked."""

        def booking(run: Callable) -> Callable:
            def turn(grid: Any, inputs: tuple, *more: Any) -> Any:
                found = run(grid, inputs, *more)
                read = found if slopes == 0 else found[0]
                states = next(len(one.scales) for one in inputs if hasattr(one, "scales"))
                readings = sum(np.size(series) for series in read.values())
                lanes = next(iter(read.values())).shape[-1]
                self.add("lanes", simulated(readings / lanes, states, slopes), lanes)
                return found

            return turn

        return booking


@contextmanager
def kept_by(ledger: Ledger) -> Iterator[None]:
    """Book every run of a large program."""
    with ExitStack() as stack:
        for module in (derived, pointwise, scores, reference_check, problem):
            stack.enter_context(patched(module, "in_batches", ledger.in_batches))
        stack.enter_context(patched(problem, "evaluate", ledger.evaluate))
        stack.enter_context(patched(newton, "_led", ledger.led))
        stack.enter_context(patched(families, "_swept", ledger.lanes(1)))
        stack.enter_context(patched(families, "_read", ledger.lanes(0)))
        yield


def patched(module: Any, name: str, made: Callable[[Callable], Callable]) -> Any:
    """A module in which another function stands in for one, for a while."""
    return mock.patch.object(module, name, made(getattr(module, name)))


def rows(bench: Bench) -> list[Row]:
    """Programs, then commands in a process that has run them before."""
    core = measured(bench.runs)
    return [_rates(core), *_programs(bench, core), *_commands(bench, core)]


def _rates(core: Core) -> Row:
    told = (
        f"{core.operations / 1e9:.3g} thousand million operations, "
        f"{core.exponentials / 1e9:.2g} of exponentials, {core.bytes / 1e9:.3g} GB a second"
    )
    return Row("one core", "what libraries reach on it", told, "-", None)


def _programs(bench: Bench, core: Core) -> list[Row]:
    """The log-posterior and its expansion."""
    z, found = jnp.asarray(bench.draws(bench.half)), bench.problem
    density = core_time(lambda: log_posterior(found, z).block_until_ready(), bench.runs)
    best = bench.found.optima[0]
    w = jnp.asarray(joined(found, best.z, best.standard))
    levels = jnp.asarray(best.z[is_noise(found)])
    expansion = core_time(lambda: jax.block_until_ready(local(found, w, levels)), bench.runs)
    return [
        _row("log-posterior, a walker", density / bench.half, evaluated(found), core),
        _row("expansion of the search", expansion, expanded(found), core),
    ]


def _commands(bench: Bench, core: Core) -> list[Row]:
    with TemporaryDirectory() as place:
        spec = generated(HIDDEN, Path(place) / "hidden", bench.quick, "--hide", "coulomb-friction")
        return [
            _command(
                "`fit calibration`", lambda out: load(bench.spec.path).fit(out, quiet=True), core
            ),
            _command(
                "`discover`, eight records", lambda out: load(spec).discover(out, quiet=True), core
            ),
        ]


def _command(what: str, run: Callable[[Path], Any], core: Core) -> Row:
    """A command for the second time in its process, programs and all loaded."""
    with TemporaryDirectory() as place:
        run(Path(place) / "first")
        began = time.process_time()
        run(Path(place) / "second")
        took = time.process_time() - began
        ledger = Ledger()
        with kept_by(ledger):
            run(Path(place) / "booked")
    runs = ", ".join(f"{often:,.0f} {what}" for what, often in ledger.runs.items())
    return _row(f"{what}, in a process that has run it before", took, ledger.work, core, runs)


def core_time(work: Callable[[], object], runs: int) -> float:
    """Median processor time of `work` [s], after a run that is not counted."""
    work()
    took = []
    for _ in range(runs):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return statistics.median(took)


def _row(what: str, took: float, work: Work, core: Core, *notes: str) -> Row:
    least = core.least(work)
    note = (
        f"{work.operations:.3g} operations, {work.exponentials:.3g} exponentials, "
        f"{work.bytes:.3g} bytes in memory"
    )
    told = f"{_seconds(took)} of a core, {took / least:.2g} times {_seconds(least)}"
    return Row(what, "what one core can do", told, "-", None, (note, *notes))


def _seconds(time: float) -> str:
    return f"{time:.3g} s" if time >= 1.0 else f"{1e3 * time:.3g} ms"
