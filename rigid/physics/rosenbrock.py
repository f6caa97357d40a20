"""Steps of a Rosenbrock method: a stiff machine, whatever its joints do, without iterations.

Each step takes the Jacobian where it begins and solves six linear systems with one matrix; order 4,
stiffly accurate. Source: Hairer and Wanner 1996, Solving Ordinary Differential Equations II, 2nd
ed., sec. IV.7 and the method RODAS of sec. VI.4, whose coefficients these are.
"""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.machine import jacobian

Outside = TypeVar("Outside")

GAMMA = 0.25
WITHIN = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
"""Share of the step at which each stage asks for the rates."""

BY_TIME = (0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0)
"""Share of the step by which each stage counts the change of the surroundings."""

AHEAD = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0),
)
BESIDE = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136,
     -6.058818238834054),
)  # fmt: skip


def step(
    rates: Callable[[Array, Outside], Array],
    flat: Array,
    begin: Outside,
    end: Outside,
    length: float,
) -> Array:
    """State (n, ...) after a step of `length` [s].

    - `rates`: (n, ...) of a flat state (n, ...) and its surroundings. - `begin`, `end`: those, a
      straight line between.
    """
    slope = jax.tree.map(lambda a, b: (b - a) / length, begin, end)

    def at(share: float) -> Outside:
        return jax.tree.map(lambda a, s: a + share * length * s, begin, slope)

    by_time = jax.jvp(lambda outside: rates(flat, outside), (begin,), (slope,))[1]
    matrix = jacobian(lambda y: rates(y, begin), flat)
    eye = jnp.eye(flat.shape[0]).reshape(*matrix.shape[:2], *(1,) * (flat.ndim - 1))
    solve = _solver(eye / (GAMMA * length) - matrix)
    found: list[Array] = []
    state = flat
    for stage in range(len(WITHIN)):
        state = flat + _mixed(AHEAD[stage], found)
        asked = rates(state, at(WITHIN[stage])) + _mixed(BESIDE[stage], found) / length
        found.append(solve(asked + length * BY_TIME[stage] * by_time))
    return state + found[-1]


def _mixed(shares: tuple[float, ...], found: list[Array]) -> Array | float:
    return sum((share * one for share, one in zip(shares, found, strict=True)), start=0.0)


def _solver(matrix: Array) -> Callable[[Array], Array]:
    """Return what solves a linear system with a matrix (n, n, ...) for (n, ...)."""
    inverted = inverse(matrix)
    return lambda right: jnp.einsum("ij...,j...->i...", inverted, right)


def inverse(matrix: Array) -> Array:
    """Inverse of matrices (n, n, ...) by Gauss and Jordan, elementwise over the later axes.

    Without a search for pivots: 1/(gamma h) on the diagonal keeps them away from 0 wherever the
    step is short beside what grows.
    """

    def swept(k: Array, a: Array) -> Array:
        row, column = a[k], a[:, k]
        pivot = row[k]
        scaled = row / pivot
        out = a - column[:, None] * scaled[None]
        out = out.at[k].set(scaled).at[:, k].set(-column / pivot)
        return out.at[k, k].set(1.0 / pivot)

    return jax.lax.fori_loop(0, matrix.shape[0], swept, matrix)
