"""Best fits from many starts, and the Gaussian law around each.

The release record has several optima in (k_LC, mu); a single start ends in one of them without a
sign of it. Starts are drawn from the prior; optimistix's Levenberg-Marquardt takes each to an
optimum of the exact likelihood (as deviance residuals); then noise levels and correlation times
are brought up to date and the best optima refined.
"""

import dataclasses
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import lineax
import numpy as np
import optimistix
from jax import Array

from rigid.correlation import Autoregression, autoregression
from rigid.noise import sample
from rigid.problem import Problem

TOLERANCE = 1e-5
"""On z; the best-known parameters have posterior sds of 1e-3 and more in z."""
MAX_STEPS = 80
KEEP_WITHIN = 40.0
"""Optima that lie further below the best in log-posterior have a weight below 1e-17."""
SAME_WITHIN = 3.0
"""Optima closer than this many standard deviations (root of mean square) are one."""
REFINEMENTS = 2
NOISE_STEP = 0.1
NOISE_ITERATIONS = 4


@dataclasses.dataclass(frozen=True)
class Optimum:
    """One mode of the posterior.

    - `z` (size,); `standard` (sensors, 2): gains and zeros there.
    - `covariance` (size, size): of the Gaussian law around it.
    - `log_posterior`: at `z`. - `reached`: number of starts that ended there.
    """

    z: np.ndarray
    standard: np.ndarray
    covariance: np.ndarray
    log_posterior: float
    reached: int


@dataclasses.dataclass(frozen=True)
class Found:
    """Outcome of a search.

    - `problem`: with weights for the correlation found. - `optima`: best first.
    - `correlation`: by (group, quantity, track), of the scores at the best optimum.
    - `starts`: how many there were. - `levels` (starts,): what each reached, half a chi-square.
    """

    problem: Problem
    optima: tuple[Optimum, ...]
    correlation: dict[tuple[int, str, int], Autoregression]
    starts: int
    levels: np.ndarray


class _Solver:
    """Levenberg-Marquardt on one problem, compiled once; noise levels are held."""

    def __init__(self, problem: Problem):
        self.noise = np.array([p.base == "noise" for p in problem.parameters.sampled])
        self.free = np.flatnonzero(~self.noise)
        self.size = problem.parameters.size
        self.shape = (len(problem.sensors), 2)

        def split(w: Array, z_noise: Array) -> tuple[Array, Array]:
            z = jnp.zeros(self.size).at[self.free].set(w[: len(self.free)])
            z = z.at[np.flatnonzero(self.noise)].set(z_noise)
            return z, w[len(self.free) :].reshape(self.shape)

        def residuals(w: Array, arguments: tuple[Array, tuple[Array, ...]]) -> Array:
            z_noise, weights = arguments
            pieces = tuple(
                dataclasses.replace(p, weight=weight)
                for p, weight in zip(problem.pieces, weights, strict=True)
            )
            return dataclasses.replace(problem, pieces=pieces).residuals(*split(w, z_noise))

        solver = optimistix.LevenbergMarquardt(
            rtol=TOLERANCE, atol=TOLERANCE, linear_solver=lineax.Normal(lineax.Cholesky())
        )

        def solve(w: Array, arguments: tuple) -> tuple[Array, Array]:
            found = optimistix.least_squares(
                residuals, solver, w, args=arguments, max_steps=MAX_STEPS, throw=False
            )
            return found.value, 0.5 * jnp.sum(residuals(found.value, arguments) ** 2)

        def information(w: Array, arguments: tuple) -> Array:
            slope = jax.jacfwd(residuals)(w, arguments)
            return slope.T @ slope

        self.solve, self.information = jax.jit(solve), jax.jit(information)
        self._split = jax.jit(split)

    def start(self, z: np.ndarray, standard: np.ndarray) -> np.ndarray:
        """Vector of the solver from z and the sensors' standard values."""
        return np.concatenate([z[self.free], standard.ravel()])

    def split(self, w: np.ndarray, z_noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parts of the solver's vector: z and the sensors' standard values."""
        z, standard = self._split(w, z_noise)
        return np.asarray(z), np.asarray(standard)


def search(
    problem: Problem, starts: int, seed: int, report: Callable[[int], None] = lambda done: None
) -> Found:
    """Find the modes of the posterior from `starts` draws of the prior.

    - `report(done)` is called after each start.
    """
    solver = _Solver(problem)
    rng = np.random.default_rng(seed)
    first = rng.standard_normal((starts, problem.parameters.size))
    first[0] = 0.0
    z_noise = np.zeros(int(solver.noise.sum()))
    weights = tuple(p.weight for p in problem.pieces)
    zero = np.zeros(solver.shape)
    begin = [solver.start(z, zero) for z in first]

    def run(w: np.ndarray) -> tuple[np.ndarray, float]:
        end, level = solver.solve(w, (z_noise, weights))
        return np.asarray(end), float(level)

    ends = []
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for done, outcome in enumerate(pool.map(run, begin), start=1):
            ends.append(outcome)
            report(done)
    levels = np.array([level if np.isfinite(level) else np.inf for _, level in ends])
    return _refined(problem, solver, [end for end, _ in ends], levels, z_noise)


def _refined(
    problem: Problem,
    solver: _Solver,
    ends: list[np.ndarray],
    levels: np.ndarray,
    z_noise: np.ndarray,
) -> Found:
    """Bring noise and correlation up to date at the best end, then refine all good ends."""
    best = ends[int(np.argmin(levels))]
    plain = problem
    correlation: dict = {}
    for _ in range(REFINEMENTS):
        z, standard = solver.split(best, z_noise)
        z = fit_noise(plain, z)
        z_noise = z[solver.noise]
        correlation = score_correlation(plain, z)
        problem = plain.with_weights(_weight_factors(plain, correlation))
        arguments = (z_noise, tuple(p.weight for p in problem.pieces))
        best = np.asarray(solver.solve(solver.start(z, standard), arguments)[0])
    good = [w for w, level in zip(ends, levels, strict=True) if np.isfinite(level)]
    distinct = _distinct(solver, [best, *good], arguments)
    optima = [_optimum(problem, solver, w, arguments, n) for w, n in distinct]
    optima.sort(key=lambda o: -o.log_posterior)
    kept = tuple(o for o in optima if o.log_posterior > optima[0].log_posterior - KEEP_WITHIN)
    return Found(problem, kept, correlation, len(ends), levels)


def _distinct(solver: _Solver, ends: list[np.ndarray], arguments: tuple) -> list:
    """Refine the first end and those that are no copies of it; count how many starts reached each."""
    found: list[list] = []
    floor = None
    for w in ends:
        near = [f for f in found if _distance(f[0], w, f[2]) < SAME_WITHIN]
        if near:
            near[0][1] += 1
            continue
        end, level = solver.solve(w, arguments)
        end, level = np.asarray(end), float(level)
        floor = level if floor is None else min(floor, level)
        near = [f for f in found if _distance(f[0], end, f[2]) < SAME_WITHIN]
        if near:
            near[0][1] += 1
        elif level < floor + KEEP_WITHIN:
            found.append([end, 0 if not found else 1, np.asarray(solver.information(end, arguments))])
    return [(w, n) for w, n, _ in found]


def _distance(a: np.ndarray, b: np.ndarray, information: np.ndarray) -> float:
    """Root mean square over the parameters of b - a in standard deviations at a."""
    return float(np.sqrt((b - a) @ information @ (b - a) / len(a)))


def _optimum(
    problem: Problem, solver: _Solver, w: np.ndarray, arguments: tuple, reached: int
) -> Optimum:
    """Lay the Gaussian law around an end of the solver."""
    z, standard = solver.split(w, arguments[0])
    covariance = np.zeros((solver.size, solver.size))
    inverse = np.linalg.inv(np.asarray(solver.information(w, arguments)))
    free = solver.free
    covariance[np.ix_(free, free)] = inverse[: len(free), : len(free)]
    noise = np.flatnonzero(solver.noise)
    bend = noise_curvature(problem, z, noise)[1]
    covariance[noise, noise] = 1.0 / np.maximum(bend, 1.0)
    value = float(problem.compiled_log_posterior(z[None])[0])
    return Optimum(z, standard, covariance, value, reached)


def noise_curvature(
    problem: Problem, z: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Slope and minus the curvature of the log-posterior along each noise level, by differences."""
    step = np.zeros((2 * len(noise) + 1, len(z)))
    rows = np.arange(len(noise))
    step[2 * rows + 1, noise], step[2 * rows + 2, noise] = NOISE_STEP, -NOISE_STEP
    value = np.asarray(problem.compiled_log_posterior(z + step))
    up, down = value[1::2], value[2::2]
    return (up - down) / (2 * NOISE_STEP), -(up - 2 * value[0] + down) / NOISE_STEP**2


def fit_noise(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Move the noise levels in z to their most probable values, the rest held, by Newton steps."""
    noise = np.flatnonzero([p.base == "noise" for p in problem.parameters.sampled])
    z = z.copy()
    for _ in range(NOISE_ITERATIONS):
        slope, bend = noise_curvature(problem, z, noise)
        z[noise] += np.clip(slope / np.maximum(bend, 1.0), -1.0, 1.0)
    return z


def score_correlation(problem: Problem, z: np.ndarray) -> dict[tuple[int, str, int], Autoregression]:
    """Autoregression of the scores of every channel at z, by (group, quantity, track)."""
    values = problem.parameters.values(jnp.asarray(z)[None])
    predictions = problem.predict(values)
    sensors = problem.fitted(jnp.asarray(z)[None]).sensors
    out = {}
    for piece in problem.pieces:
        m, sigma = piece.reading(predictions), piece.sigma(values)
        for i, track in enumerate(piece.tracks):
            best = sensors[piece.sensor(i)].best
            r = piece.data[:, i] - (1.0 + best.gain) * m[:, i, 0] - best.zero
            score = sample(r, sigma[i, 0], piece.sheet.step, piece.sheet.noise).slope
            out[piece.group, piece.quantity, track] = autoregression(
                np.asarray(score), piece.weight[:, i] > 0
            )
    return out


def _weight_factors(problem: Problem, correlation: dict) -> dict[tuple[int, str], np.ndarray]:
    """One over the correlation time of every channel."""
    return {
        (p.group, p.quantity): np.array(
            [1.0 / correlation[p.group, p.quantity, t].time for t in p.tracks]
        )
        for p in problem.pieces
    }
