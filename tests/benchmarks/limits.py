"""How far programs and commands are from what one core can do: arithmetic, memory, exponentials.

What a program asks for is counted in what JAX traces, before XLA makes it shorter or longer: a loop
that ends when it is done counts once, so that limits are too low rather than too high. What the
exact propagation of a rig's states takes at least is counted by hand.
"""

import math
import statistics
import threading
import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import prod
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest import mock

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from campaign import Bench, median_time
from jax import Array
from jax.extend import core
from table import Row
from wait import HIDDEN, generated

from rigid.inference import derived, pointwise, reference_check, scores
from rigid.inference.newton import is_noise, joined, local
from rigid.likelihood import problem
from rigid.likelihood.problem import Problem, log_posterior, walkers
from rigid.localfit import families
from rigid.study.study import load

STATES = 7
"""Of a rig with two branches of friction: two positions and speeds, a pressure, two forces."""
OF_A_SUM = 2
"""Operations of a product that is added to a sum."""
OF_A_READING = 4
"""Operations of a Gaussian density: difference, quotient, square, sum."""

COUNTED = ("add", "sub", "mul", "div", "neg", "max", "min", "sqrt", "rsqrt", "abs", "square")
"""Primitives of one operation for each number they give."""
SUMMED = ("reduce_sum", "reduce_max", "reduce_min", "cumsum", "add_any")
"""Primitives of one operation for each number they take."""
CURVED = (
    "exp", "exp2", "expm1", "log", "log1p", "tanh", "logistic", "erf", "erfc", "erf_inv", "sin",
    "cos", "tan", "atan2", "pow", "cbrt", "lgamma",
)  # fmt: skip
"""Primitives that no core has an instruction for; each counts as one exponential."""


@dataclass(frozen=True)
class Work:
    """What is asked of a core.

    - `operations`: additions and products. - `exponentials`: and their like. - `bytes`: taken and
      given; what lies between may stay in the core.
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


def asked_for(program: Callable, *given: Any) -> Work:
    """Count what a program asks for, arguments and results in memory included."""
    closed = eqx.filter_make_jaxpr(program)(*given)[0]
    avals = (*closed.in_avals, *closed.out_avals)
    moved = sum(prod(a.shape) * a.dtype.itemsize for a in avals)
    return _counted(closed.jaxpr) + Work(bytes=float(moved))


def _counted(jaxpr: core.Jaxpr) -> Work:
    return sum((_of(equation) for equation in jaxpr.eqns), Work())


def _of(equation: core.JaxprEqn) -> Work:
    """Count one equation, with what is inside it."""
    name, given = equation.primitive.name, equation.params
    inside = [_counted(part) for part in _parts(given)]
    if inside and name == "cond":
        return min(inside, key=lambda work: work.operations)
    if inside:
        return sum(inside, Work()).times(given.get("length", 1) if name == "scan" else 1)
    taken, gives = sum(map(_numbers, equation.invars)), sum(map(_numbers, equation.outvars))
    if name == "dot_general":
        (contracted, _), _ = given["dimension_numbers"]
        first: Any = equation.invars[0].aval
        return Work(OF_A_SUM * prod(first.shape[i] for i in contracted) * gives)
    if name == "integer_pow":
        return Work(gives * max(abs(given["y"]).bit_length() - 1, 1))
    if name in CURVED:
        return Work(exponentials=gives)
    return Work(gives if name in COUNTED else taken if name in SUMMED else 0)


def _numbers(one: Any) -> int:
    """How many numbers a variable of an equation holds."""
    return prod(one.aval.shape)


def _parts(given: Mapping[str, Any]) -> Iterator[core.Jaxpr]:
    """The programs inside an equation."""
    for value in given.values():
        for one in value if isinstance(value, tuple | list) else (value,):
            if isinstance(one, core.ClosedJaxpr):
                yield one.jaxpr
            elif isinstance(one, core.Jaxpr):
                yield one


class Ledger:
    """What the large programs of a command ask for while it runs."""

    def __init__(self) -> None:
        self.programs: dict[Hashable, Work] = {}
        self.calls: dict[Hashable, float] = {}
        self._lock = threading.Lock()

    @property
    def work(self) -> Work:
        """All of it."""
        return sum((self.programs[k].times(n) for k, n in self.calls.items()), Work())

    def add(self, program: Callable, *given: Any, often: float = 1.0) -> None:
        """Book some runs of a program; it is traced where no run of its shape was booked before."""
        key = program.__qualname__, _shape(given)
        with self._lock:
            if key not in self.programs:
                self.programs[key] = asked_for(program, *given)
            self.calls[key] = self.calls.get(key, 0.0) + often

    def booking(self, program: Callable) -> Callable:
        """The same program, with every run booked."""

        def run(*given: Any) -> Any:
            self.add(program, *given)
            return program(*given)

        return run

    def batched(self, run: Callable) -> Callable:
        """`in_batches`, with every batch booked."""

        def each(program: Callable, problem: Problem, z: np.ndarray) -> Any:
            found = run(program, problem, z)
            if program is not log_posterior:  # booked where it is evaluated
                half = walkers(problem) // 2
                batch = jnp.zeros((half, z.shape[1]))
                self.add(program, problem, batch, often=math.ceil(len(z) / half))
            return found

        return each

    def minimised(self, run: Callable) -> Callable:
        """`optimistix.minimise`, with the expansion of every step booked."""

        def lead(fn: Callable, solver: Any, y0: Array, args: Any, **more: Any) -> Any:
            solution = run(fn, solver, y0, args, **more)
            self.add(fn, y0, args, often=float(solution.stats["num_steps"]) + 1.0)
            return solution

        return lead


def _shape(given: tuple) -> Hashable:
    arrays, rest = eqx.partition(given, eqx.is_array)
    leaves, tree = jax.tree.flatten(arrays)
    return tuple((a.shape, str(a.dtype)) for a in leaves), tree, str(jax.tree.structure(rest))


@contextmanager
def kept_by(ledger: Ledger) -> Iterator[None]:
    """Book every run of a large program."""
    with ExitStack() as stack:
        for module in (derived, pointwise, scores, reference_check, problem):
            stack.enter_context(patched(module, "in_batches", ledger.batched))
        stack.enter_context(patched(problem, "evaluate", ledger.booking))
        stack.enter_context(patched(optx, "minimise", ledger.minimised))
        for name in ("_swept", "_read"):
            stack.enter_context(patched(families, name, ledger.booking))
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
    """The log-posterior and its expansion, against their own count and against the least."""
    z = jnp.asarray(bench.draws(bench.half))
    found = bench.problem
    density = core_time(lambda: log_posterior(found, z).block_until_ready(), bench.runs)
    each = asked_for(log_posterior, found, z).times(1.0 / bench.half)
    noisy = is_noise(found)
    best = bench.found.optima[0]
    w, levels = jnp.asarray(joined(found, best.z, best.standard)), jnp.asarray(best.z[noisy])
    steep = jax.jit(lambda w, levels: local(found, w, levels))
    expansion = core_time(lambda: jax.block_until_ready(steep(w, levels)), bench.runs)
    return [
        _row("log-posterior, a walker", density / bench.half, each, core),
        _row("the same, exact propagation alone", density / bench.half, exact(found), core),
        _row("expansion of the search", expansion, asked_for(local, found, w, levels), core),
    ]


def exact(found: Problem) -> Work:
    """What one log-posterior takes at least, by hand.

    Readings of every sample are a product of a matrix with the state some samples before, whatever
    the state is then; each is held against one exponential, as a converter asks for.
    """
    readings = sum(float(np.sum(piece.weight > 0)) for piece in found.pieces)
    return Work(
        readings * (OF_A_SUM * STATES + OF_A_READING),
        readings,
        readings * np.dtype(float).itemsize,
    )


def _commands(bench: Bench, core: Core) -> list[Row]:
    with TemporaryDirectory() as place:
        spec = generated(HIDDEN, Path(place) / "hidden", bench.quick, "--hide", "coulomb-friction")
        return [
            _command("`fit calibration`", lambda out: load(bench.spec.path).fit(out), core),
            _command("`discover`, eight records", lambda out: load(spec).discover(out), core),
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
    return _row(f"{what}, in a process that has run it before", took, ledger.work, core)


def core_time(work: Callable[[], object], runs: int) -> float:
    """Median processor time of `work` [s], after a run that is not counted."""
    work()
    took = []
    for _ in range(runs):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return statistics.median(took)


def _row(what: str, took: float, work: Work, core: Core) -> Row:
    least = core.least(work)
    note = (
        f"{work.operations:.3g} operations, {work.exponentials:.3g} exponentials, "
        f"{work.bytes:.3g} bytes in memory"
    )
    told = f"{_seconds(took)} of a core, {took / least:.2g} times {_seconds(least)}"
    return Row(what, "what one core can do", told, "-", None, (note,))


def _seconds(time: float) -> str:
    return f"{time:.3g} s" if time >= 1.0 else f"{1e3 * time:.3g} ms"
