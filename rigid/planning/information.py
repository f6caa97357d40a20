"""What a record would tell: the posterior's precision with it, before it is taken.

Around a point of the posterior the log-posterior is quadratic, with the information J of the
records there are. One more record adds S = G_ss - G_so (G_oo + 1)^-1 G_os of what it shares with
the others, G being its own information and o its own numbers (flow fraction, preload, instant),
which are new and have their priors. The variance of a quantity with slope g then is
g (J + n S)^-1 g for n such records. G is that of readings simulated at the point.

Source: Chaloner and Verdinelli (1995), Statistical Science 10, section 4 (Bayesian design of
experiments by the information of a local approximation).
"""

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_factor, cho_solve

from rigid.inference.newton import expanded, is_noise, joined
from rigid.likelihood.problem import Problem, evaluate, in_batches, predict


@dataclasses.dataclass(frozen=True, eq=False)
class Point:
    """A point of the posterior.

    - `z` (size,). - `standard` (sensors, 2): most probable gains and zeros there, in prior sds.
    """

    z: Float[np.ndarray, " size"]
    standard: Float[np.ndarray, "sensors 2"]


def point(problem: Problem, z: Float[np.ndarray, " size"]) -> Point:
    """Return the point at z, with gains and zeros."""
    [(found, _)] = in_batches(evaluate, problem, z[None])
    spreads = {p.sensor(i): p.sheet.spread for p in problem.pieces for i in range(len(p.tracks))}
    rows = [
        [
            value / spread if spread > 0.0 else 0.0
            for value, spread in zip(found.sensors[label][:2, 0], spreads[label], strict=True)
        ]
        for label in problem.sensors
    ]
    return Point(z, np.array(rows, dtype=float))


def entries(problem: Problem) -> list[str]:
    """Names of the rows of `information`: uncertain numbers, then gain and zero of each sensor."""
    free = [p.label for p in problem.parameters.sampled if p.base != "noise"]
    return [*free, *(f"{part}[{one}]" for one in problem.sensors for part in ("gain", "zero"))]


def at_sensors(
    base: Problem, new: Problem, standard: Float[np.ndarray, "sensors 2"]
) -> Float[np.ndarray, "more 2"]:
    """Gains and zeros of a problem that has further sensors, those at 0."""
    known = dict(zip(base.sensors, standard, strict=True))
    return np.array([known.get(label, np.zeros(2)) for label in new.sensors])


def information(problem: Problem, at: Point) -> Float[np.ndarray, "own own"]:
    """Information of a problem's records and priors at a point: numbers, then gains and zeros."""
    w = joined(problem, at.z, at.standard)
    return np.asarray(expanded(problem, w, at.z[is_noise(problem)]).information)


def simulated(
    problem: Problem, at: Point, rng: np.random.Generator
) -> tuple[Problem, dict[str, float]]:
    """Return the problem with readings simulated at a point.

    And the greatest magnitude that each quantity reads in the pieces that count.
    """
    [(read, _)] = in_batches(predict, problem, at.z[None])
    values = problem.parameters.values(jnp.asarray(at.z[None]))
    pieces, most = [], {}
    for piece in problem.pieces:
        sensors = [problem.sensors.index(label) for label in piece.sensors]
        spread = np.array(piece.sheet.spread)
        gain, zero = (at.standard[sensors] * spread).T
        true = read[piece.group][piece.quantity][:, list(piece.tracks), 0]
        noise = rng.standard_normal(true.shape) * np.asarray(piece.sigma(values))[:, 0]
        data = (1.0 + gain) * true + zero + noise
        if piece.sheet.step > 0.0:
            data = np.round(data / piece.sheet.step) * piece.sheet.step
        counts = np.asarray(piece.weight) > 0.0
        if counts.any():
            here = float(np.abs(np.where(counts, true, 0.0)).max())
            most[piece.quantity] = max(most.get(piece.quantity, 0.0), here)
        pieces.append(dataclasses.replace(piece, data=data))
    return dataclasses.replace(problem, pieces=tuple(pieces)), most


def added(
    alone: Float[np.ndarray, "size size"], private: Int[np.ndarray, " own"]
) -> Float[np.ndarray, "size size"]:
    """Information that one more record adds to what it shares with the others.

    - `alone`: its own information and the priors. - `private`: places of its own numbers.
    """
    shared = np.setdiff1d(np.arange(len(alone)), private)
    out = np.zeros_like(alone)
    told = alone - np.eye(len(alone))
    left = told[np.ix_(shared, shared)]
    if len(private):
        across = alone[np.ix_(private, shared)]
        left = left - across.T @ cho_solve(cho_factor(alone[np.ix_(private, private)]), across)
    out[np.ix_(shared, shared)] = 0.5 * (left + left.T)
    return out


def sd(precision: Float[np.ndarray, "size size"], slope: Float[np.ndarray, " size"]) -> float:
    """Standard deviation of a quantity with a slope, under a Gaussian law of a precision."""
    return float(np.sqrt(slope @ cho_solve(cho_factor(precision), slope)))


def shift(
    known: Float[np.ndarray, "size size"],
    adds: Float[np.ndarray, "size size"],
    off: Float[np.ndarray, " size"],
    rng: np.random.Generator,
) -> Float[np.ndarray, " size"]:
    """Draw how far the best fit moves when a record is added, (J + S)^-1 (S t + s).

    s are the slopes of the new readings at the truth, of covariance S. Over truths of the
    posterior the shift has the covariance J^-1 - (J + S)^-1.

    - `known`: J. - `adds`: S. - `off`: the truth t, from the best fit.
    """
    values, vectors = np.linalg.eigh(adds)
    root = vectors * np.sqrt(np.maximum(values, 0.0))  # positive, but for rounding
    return np.linalg.solve(known + adds, adds @ off + root @ rng.standard_normal(len(off)))
