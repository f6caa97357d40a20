"""Probability that a converter rounds a reading to the code on record.

The exact expression takes error functions; evaluated for tens of thousands of samples and each
walker it would be most of the work of a fit. For one noise level it is an even, analytic function
of the residual alone, so `Curve` interpolates it by a Chebyshev polynomial, made anew for every
noise level from a few exact values (errors below: tests/test_quantisation.py).
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erfc

SQRT2 = 2.0**0.5
LOG_SQRT_2PI = 0.9189385332046727
FAR = 25.0
"""Beyond it erfc underflows and its asymptotic series takes over; the series is exact there."""
DEGREE = 20
REACH = 5.0
"""The polynomial covers residuals up to half a step and 5 standard deviations; beyond, where one
sample in 10^6 falls, it is continued by a parabola of the asymptotic curvature."""


def _nodes_and_transform() -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev nodes and the matrix from values there to coefficients of powers of u."""
    angle = np.pi * (np.arange(DEGREE) + 0.5) / DEGREE
    cosine = np.cos(np.outer(np.arange(DEGREE), angle)) * 2.0 / DEGREE
    cosine[0] /= 2.0
    powers = np.zeros((DEGREE, DEGREE))
    for k in range(DEGREE):
        row = np.polynomial.chebyshev.cheb2poly(np.eye(DEGREE)[k])
        powers[: len(row), k] = row
    return np.cos(angle), powers @ cosine


NODES, TO_POWERS = _nodes_and_transform()


def scaled_erfc(x: Array) -> Array:
    """exp(x^2) erfc(x), stable for every x above -25."""
    near = jnp.minimum(x, FAR)
    far = jnp.maximum(x, FAR)
    inverse = 1.0 / (far * far)
    tail = (1.0 - inverse * (0.5 - 0.75 * inverse)) / (far * jnp.sqrt(jnp.pi))
    return jnp.where(x < FAR, jnp.exp(near * near) * erfc(near), tail)


class Point(NamedTuple):
    """Log-probability of samples and its first two derivatives by the expected reading."""

    value: Array
    slope: Array
    curvature: Array


def interval(residual: Array, sigma: Array, step: float | Array) -> Point:
    """Log-probability that a reading rounds to the recorded code, stable in the tails.

    - `residual`: recorded value less expected reading. - `sigma`: noise before conversion.
    - `step`: of the converter, above 0; all in the same unit.
    """
    r, half = jnp.abs(residual) / sigma, 0.5 * step / sigma
    low, high = r - half, r + half
    fade = jnp.exp(-2.0 * r * half)
    mass = 0.5 * (scaled_erfc(low / SQRT2) - fade * scaled_erfc(high / SQRT2))
    value = jnp.log(mass) - 0.5 * low * low
    scale = jnp.exp(-LOG_SQRT_2PI) / mass
    ratio_low, ratio_high = scale, scale * fade
    score = ratio_low - ratio_high
    curvature = low * ratio_low - high * ratio_high - score * score
    return Point(value, jnp.sign(residual) * score / sigma, curvature / sigma**2)


class Curve(NamedTuple):
    """`interval` for given noise levels as a polynomial in the squared residual.

    The probability is log-concave; where it is flat, in the middle of a wide step, the polynomial
    waves a little about it, and a curvature that comes out above 0 is 0.

    - `powers` (DEGREE, ...): coefficients, over the noise levels' shape.
    - `reach` (...): greatest residual covered, in noise sds. - `sigma` (...): noise.
    """

    powers: Array
    reach: Array
    sigma: Array

    def __call__(self, residual: Array) -> Point:
        """Log-probability of samples and its derivatives, as `interval` gives them."""
        size = jnp.abs(residual) / self.sigma
        r = jnp.minimum(size, self.reach)
        beyond = size - r
        u = 2.0 * (r / self.reach) ** 2 - 1.0
        inner = 4.0 / self.reach**2
        order = jnp.arange(1, DEGREE).reshape((-1,) + (1,) * jnp.ndim(self.sigma))
        first = order * self.powers[1:]
        second = order[:-1] * first[1:]
        slope = _horner(first, u) * inner * r
        curvature = _horner(second, u) * (inner * r) ** 2 + _horner(first, u) * inner
        return Point(
            _horner(self.powers, u) + slope * beyond - 0.5 * beyond**2,
            -jnp.sign(residual) * (slope - beyond) / self.sigma,
            jnp.where(beyond > 0.0, -1.0, jnp.minimum(curvature, 0.0)) / self.sigma**2,
        )


def curve(sigma: Array, step: float | Array) -> Curve:
    """Interpolate `interval` for noise levels of any shape.

    - `sigma`: noise before conversion, `step`: of the converter, in the same unit.
    """
    reach = 0.5 * step / sigma + REACH
    place = jnp.asarray(np.sqrt(0.5 * (1.0 + NODES))).reshape((-1,) + (1,) * jnp.ndim(sigma))
    exact = interval(place * reach * sigma, sigma, step).value
    return Curve(jnp.tensordot(jnp.asarray(TO_POWERS), exact, 1), reach, sigma)


def _horner(powers: Array, u: Array) -> Array:
    """Polynomial at u; every intermediate is used once, so that it compiles to one loop."""
    value = powers[-1] * jnp.ones_like(u)
    for k in range(powers.shape[0] - 2, -1, -1):
        value = value * u + powers[k]
    return value
