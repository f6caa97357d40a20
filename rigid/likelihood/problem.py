"""Rig, records, noise and priors put together: predictions and the log-posterior of z."""

import dataclasses
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.effects import AbstractEffect
from rigid.io.compiled import compiled
from rigid.io.runtime import require_double
from rigid.likelihood.channels import Piece
from rigid.likelihood.groups import AbstractGroup, predictions
from rigid.likelihood.machine import Place
from rigid.likelihood.marginal import MarginalLikelihood, marginal_likelihood
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.tracks import Track

LOG_2PI = 1.8378770664093453


class Evaluation(NamedTuple):
    """What the records say of points of the parameters.

    - `log_posterior` (walkers,): -inf where it is no number. - `tracks`: by label of the track, the
      log-likelihood (walkers,) of its samples. - `sensors`: by label, (5, walkers): most probable
      gain and zero, variance of the gain, covariance, variance of the zero.
    """

    log_posterior: Array
    tracks: dict[str, Array]
    sensors: dict[str, Array]


class Problem(eqx.Module):
    """All that a fit needs, immutable.

    - `effects`: classes of what acts on the rig. - `parameters`: the uncertain numbers.
    - `groups`: records that are simulated together. - `pieces`: what there is to explain.

    Arrays of parameters are (walkers, size) in z, (walkers,) by label in SI.
    """

    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    parameters: Parameters
    groups: tuple[AbstractGroup, ...]
    pieces: tuple[Piece, ...]

    def __check_init__(self):
        require_double()

    def predict(self, values: Mapping[str, Array]) -> list[dict[str, Array]]:
        """Ideal readings of every group, by quantity, (samples, tracks, walkers)."""
        return predictions(self.groups, [values] * len(self.groups))

    def marginal_likelihood(self, z: Array) -> MarginalLikelihood:
        """Log-likelihood of z (walkers, size) and the law of the sensors' gains and zeros."""
        values = self.parameters.values(z)
        return marginal_likelihood(self.pieces, self.predict(values), values)

    def evaluate(self, z: Array) -> Evaluation:
        """Evaluate z (walkers, size), with gains and zeros integrated out of the density.

        Raises EnvironmentFaultError where JAX computes in 32 bits.
        """
        require_double()
        found = self.marginal_likelihood(z)
        prior = -0.5 * jnp.sum(z * z, axis=1) - 0.5 * self.parameters.size * LOG_2PI
        value = found.value + prior
        return Evaluation(
            jnp.where(jnp.isfinite(value), value, -jnp.inf),
            {self.groups[g].tracks[t].label: value for (g, t), value in found.tracks.items()},
            {
                label: jnp.stack([s.best.gain, s.best.zero, s.var_gain, s.covariance, s.var_zero])
                for label, s in found.sensors.items()
            },
        )

    def log_posterior(self, z: Array) -> Array:
        """Log-posterior density of z (walkers, size)."""
        return self.evaluate(z).log_posterior

    @property
    def tracks(self) -> tuple[Track, ...]:
        """All tracks, group by group."""
        return tuple(t for group in self.groups for t in group.tracks)

    def track(self, label: str) -> Track:
        """Return the track of a label, "record,cylinder"."""
        return next(t for t in self.tracks if t.label == label)

    @property
    def of_the_rig(self) -> bool:
        """Whether a record is of the rig; motions alone may be those of any machine."""
        return any(t.of.of_the_rig() for t in self.tracks)

    @property
    def places(self) -> tuple[Place, ...]:
        """Joints of the machine that the records are of; () for the rig of eqs. (19)-(22)."""
        return next((group.places for group in self.groups), ())

    @property  # a cached value would change the structure that programs are kept by
    def sensors(self) -> tuple[str, ...]:
        """Labels of the sensors, "quantity,cylinder", in order."""
        return tuple(dict.fromkeys(p.sensor(i) for p in self.pieces for i in range(len(p.tracks))))

    @property
    def tolerance(self) -> float | None:
        """That of the full solve by diffrax; None: exponential steps predict."""
        return next((g.tolerance for g in self.groups), None)

    def with_tolerance(self, tolerance: float | None) -> "Problem":
        """Return the same problem solved in full by diffrax, or by steps."""
        groups = tuple(dataclasses.replace(g, tolerance=tolerance) for g in self.groups)
        return dataclasses.replace(self, groups=groups)

    def with_weights(self, weights: Mapping[tuple[int, str], np.ndarray]) -> "Problem":
        """Return the same problem with other weights, by (group, quantity)."""
        new = [jnp.asarray(weights[p.group, p.quantity]) for p in self.pieces]
        return eqx.tree_at(lambda q: [p.weight for p in q.pieces], self, new)


@compiled
def evaluate(problem: Problem, z: Array) -> Evaluation:
    """`problem.evaluate`, compiled once for all problems of the same shape."""
    return problem.evaluate(z)


def log_posterior(problem: Problem, z: Array) -> Array:
    """Log-posterior density of z (walkers, size), compiled."""
    return evaluate(problem, z).log_posterior


@compiled
def predict(problem: Problem, z: Array) -> list[dict[str, Array]]:
    """Ideal readings at z (walkers, size), compiled."""
    return problem.predict(problem.parameters.values(z))


def walkers(problem: Problem) -> int:
    """Walkers of an ensemble where a spec names none: at least 2.5 times the parameters."""
    return max(64, 32 * -(-5 * problem.parameters.size // 64))


def in_batches(
    program: Callable[[Problem, Array], Any], problem: Problem, z: np.ndarray
) -> list[tuple[Any, int]]:
    """Run a program on z (n, size), half an ensemble at a time: one shape does for all.

    All cores take part. Returns what each batch gave, in NumPy, with the number of its rows that
    count.
    """
    size = walkers(problem) // 2

    def one(begin: int) -> tuple[Any, int]:
        rows = z[begin : begin + size]
        padded = np.pad(rows, ((0, size - len(rows)), (0, 0)), mode="edge")
        return jax.tree.map(np.asarray, program(problem, jnp.asarray(padded))), len(rows)

    first = one(0)
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return [first, *pool.map(one, range(size, len(z), size))]


def log_density(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Log-posterior of z (n, size)."""
    return np.concatenate([values[:n] for values, n in in_batches(log_posterior, problem, z)])
