"""Exponential integrator: step matrices that lead through oscillations and stiffness.

A step is y + Phi(h) f(y) with Phi(h) = integral of exp(A s) ds from 0 to h and A the Jacobian of
the rig's own equations; it is exact for a linear rig under constant flow. Source: Hochbruck and
Ostermann 2010, Acta Numerica 19, exponential Rosenbrock methods.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from collections.abc import Sequence
from functools import reduce
from math import factorial
from operator import add

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.rig import Rig, Surroundings

DOUBLINGS = 12
TAYLOR_DEGREE = 8
"""4,096 sub-steps a sample keep the Taylor remainder below 1e-11 up to mu = 5e6 N s/m."""

NEAR = 0.1
"""Exponent below which `growths` are series: where they end, the next term is below 1e-16."""

RAMP = tuple(factorial(n) for n in range(11, 1, -1))
"""Divisors of the series of (exp(x) - 1 - x)/x^2, the highest power first."""


def product(left: Array, right: Array) -> Array:
    """Matrix product over the first two axes, elementwise over the rest."""
    return reduce(add, (left[:, j, None] * right[None, j] for j in range(left.shape[1])))


def apply(matrix: Array, vector: Array) -> Array:
    """Matrix times vector over the first axes, elementwise over the rest."""
    return reduce(add, (matrix[:, j] * vector[j] for j in range(matrix.shape[1])))


def growths(exponent: Array) -> tuple[Array, Array]:
    """Means of exp(s x) and of (exp(s x) - 1)/x over s from 0 to 1; 1 and 1/2 at x = 0.

    Of one exponential, the dearest operation of a step with dry friction: near 0 a series takes its
    place, so that both keep twelve digits.
    """
    near = jnp.abs(exponent) < NEAR
    safe = jnp.where(near, 1.0, exponent)
    series = jnp.full_like(exponent, 1.0 / RAMP[0])
    for divisor in RAMP[1:]:
        series = series * exponent + 1.0 / divisor
    far = (jnp.exp(safe) - 1.0) / safe
    ramp = jnp.where(near, series, (far - 1.0) / safe)
    return jnp.where(near, 1.0 + exponent * series, far), ramp


def mean_growth(exponent: Array) -> Array:
    """(exp(x) - 1)/x, the mean of exp(s x) over s from 0 to 1; 1 at x = 0."""
    return growths(exponent)[0]


def jacobian(rig: Rig, outside: Surroundings, column: Array) -> Array:
    """Derivative of the rates by the state at rest, shape (n, n, *column.shape)."""
    n = len(rig.scales)
    rest = jnp.zeros((n, *jnp.broadcast_shapes(column.shape, rig.column.shape)))

    def rates(flat: Array) -> Array:
        moved = rig.motion(flat, outside, column).rates
        return jnp.stack([jnp.broadcast_to(r, rest.shape[1:]) for r in moved])

    def along(i: Array) -> Array:
        return jax.jvp(rates, (rest,), (rest.at[i].set(1.0),))[1]

    return jnp.moveaxis(jax.vmap(along)(jnp.arange(n)), 0, 1)


def step_matrix(
    matrix: Array, length: Array | float, scales: Sequence[float], doublings: int = DOUBLINGS
) -> Array:
    """Phi(h), the integral of exp(A s) over s from 0 to h, by Taylor series and doubling.

    - `matrix` (n, n, ...) [1/s]: A. - `length` [s]: h, broadcasts over the trailing axes.
    - `scales` (n,): typical sizes of the states; without them the products overflow the precision.
    - `doublings`: fewer serve a step that is shorter than a sample.
    """
    scale = jnp.asarray(scales).reshape((len(scales), 1) + (1,) * (matrix.ndim - 2))
    unscale = jnp.moveaxis(scale, 0, 1)
    balanced = matrix * unscale / scale
    small = jnp.asarray(length) / 2**doublings
    phi = small * _mean_growth(balanced * small)
    return longer(balanced, phi, doublings) * scale / unscale


def longer(matrix: Array, phi: Array, doublings: int) -> Array:
    """Phi(2^doublings h) from Phi(h), (n, n, ...), and A.

    exp(A h) goes along: squared it is that of the double step. To have it from Phi each time takes
    a product of a product, which XLA works out once for every number that asks for it.
    """

    def twice(_: Array, pair: tuple[Array, Array]) -> tuple[Array, Array]:
        growth, phi = pair
        return product(growth, growth), phi + product(growth, phi)

    begin = _unit(phi) + product(matrix, phi), phi
    return jax.lax.fori_loop(0, doublings, twice, begin)[1]


def step_column(
    matrix: Array, length: Array, scales: Sequence[float], column: int, doublings: int = DOUBLINGS
) -> Array:
    """One column of `step_matrix`, (n, ...): what a unit rate of one state does in a step."""
    scale = jnp.asarray(scales).reshape((len(scales), 1) + (1,) * (matrix.ndim - 2))
    balanced = matrix * jnp.moveaxis(scale, 0, 1) / scale
    small = jnp.asarray(length) / 2**doublings
    tiny = balanced * small
    phi = _mean_growth(tiny)

    def twice(_: Array, pair: tuple[Array, Array]) -> tuple[Array, Array]:
        growth, moved = pair
        return product(growth, growth), moved + apply(growth, moved)

    begin = _unit(tiny) + product(tiny, phi), small * phi[:, column]
    moved = jax.lax.fori_loop(0, doublings, twice, begin)[1]
    return moved * scale[:, 0] / scale[column, 0]


def _unit(like: Array) -> Array:
    """Identity over the first two axes."""
    return jnp.eye(len(like)).reshape(like.shape[:2] + (1,) * (like.ndim - 2))


def _mean_growth(exponent: Array) -> Array:
    """(exp(X) - 1)/X of a small matrix X, by its series."""
    unit = _unit(exponent)

    def horner(k: Array, series: Array) -> Array:
        return unit + product(exponent, series) / (TAYLOR_DEGREE + 1 - k)

    return jax.lax.fori_loop(0, TAYLOR_DEGREE, horner, unit + jnp.zeros_like(exponent))
