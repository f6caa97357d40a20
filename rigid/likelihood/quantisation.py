"""Probability that a converter rounds a reading to the code on record.

The exact expression takes error functions; evaluated for tens of thousands of samples and each
walker it would be most of the work of a fit. For one noise level it is an even, analytic function
of the residual alone, so `Curve` interpolates it: polynomials made anew for every noise level, from
a few exact values (errors: tests/test_quantisation.py).
"""

from functools import cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erfc
from numpy.polynomial import Chebyshev, Polynomial

SQRT2 = 2.0**0.5
LOG_SQRT_2PI = 0.9189385332046727
FAR = 25.0
"""Beyond it erfc underflows and its asymptotic series takes over; the series is exact there."""
FEW, MANY, WIDE = 11, 17, 5.0
"""Exact values for a noise level: few where the step is up to WIDE noise sds, else many. Few are
off by a mean of 2e-10 a sample where it is 6 sds, 2e-7 where it is 12."""
REACH = 5.0
"""The interpolation covers residuals up to half a step and 5 standard deviations; beyond, where one
sample in 10^6 falls, it is continued by a parabola of the asymptotic curvature."""


class Basis(NamedTuple):
    """Where the exact values are taken, and matrices from these to polynomials.

    The log-probability f of a large residual r grows as r^2. So f v / half is interpolated, with
    half = reach^2 / 2 and v = 1 / (1 + r^2 / half): a polynomial P(v) of degree 10 is as near as
    one of degree 19 for f in r^2. Slopes of f by r^2 are P - v P' and v^3 P'' / half, polynomials
    as well. v is from 1/3 to 1; powers are of t = 3 v - 2.

    - `places` (nodes,): residuals over reach.
    - `value`, `slope`, `curvature` (powers, nodes): of P, df/dr / 2r and d2f/dr2.
    """

    places: np.ndarray
    value: np.ndarray
    slope: np.ndarray
    curvature: np.ndarray


@cache
def _basis(nodes: int) -> Basis:
    """Work the matrices out, a column for the interpolant that is 1 at one node, 0 at others."""
    angle = np.pi * (np.arange(nodes) + 0.5) / nodes
    cosine = np.cos(np.outer(np.arange(nodes), angle)) * 2.0 / nodes
    cosine[0] /= 2.0
    v = Polynomial([2.0 / 3.0, 1.0 / 3.0])
    curves = [Chebyshev(column).convert(kind=Polynomial) for column in cosine.T]
    slopes = [one - 3.0 * v * one.deriv() for one in curves]
    bends = [
        2.0 * slope + 36.0 * (1.0 - v) * v**2 * one.deriv(2)
        for one, slope in zip(curves, slopes, strict=True)
    ]
    matrices = (
        np.stack([np.pad(one.coef, (0, size - len(one.coef))) for one in some], axis=1)
        for some, size in ((curves, nodes), (slopes, nodes), (bends, nodes + 1))
    )
    return Basis(np.sqrt(0.5 * (1.0 / v(np.cos(angle)) - 1.0)), *matrices)


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
    """`interval` for given noise levels, interpolated in the squared residual.

    The probability is log-concave; where it is flat, in the middle of a wide step, the polynomial
    waves a little about it, and a curvature that comes out above 0 is 0.

    - `value`, `slope`, `curvature` (powers, ...): coefficients of polynomials in t, over the noise
      levels' shape. - `reach` (...): greatest residual covered, in noise sds. - `sigma` (...):
      noise.
    """

    value: Array
    slope: Array
    curvature: Array
    reach: Array
    sigma: Array

    def __call__(self, residual: Array) -> Point:
        """Log-probability of samples and its derivatives, as `interval` gives them."""
        size = jnp.abs(residual) * (1.0 / self.sigma)
        r = jnp.minimum(size, self.reach)
        beyond = size - r
        half = 0.5 * self.reach**2
        inverse = 1.0 + r * r * (1.0 / half)
        t = 3.0 / inverse - 2.0
        slope = 2.0 * r * _horner(self.slope, t)
        curvature = jnp.minimum(_horner(self.curvature, t), 0.0)
        return Point(
            half * inverse * _horner(self.value, t) + slope * beyond - 0.5 * beyond**2,
            jnp.sign(residual) * (beyond - slope) * (1.0 / self.sigma),
            jnp.where(beyond > 0.0, -1.0, curvature) * (1.0 / self.sigma**2),
        )


def nodes_of(step: float, noise: float) -> int:
    """How many exact values the law of a sensor takes, by the step and noise of its sheet."""
    return FEW if step <= WIDE * noise else MANY


def curve(sigma: Array, step: float | Array, nodes: int = MANY) -> Curve:
    """Interpolate `interval` for noise levels of any shape.

    - `sigma`: noise before conversion, `step`: of the converter, in the same unit. - `nodes`: exact
      values for each level.
    """
    basis = _basis(nodes)
    reach = 0.5 * step / sigma + REACH
    place = jnp.asarray(basis.places).reshape((-1,) + (1,) * jnp.ndim(sigma))
    exact = interval(place * reach * sigma, sigma, step).value
    ratio = exact / ((place * place + 0.5) * reach**2)

    def powers(matrix: np.ndarray) -> Array:
        return jnp.tensordot(jnp.asarray(matrix), ratio, 1)

    return Curve(powers(basis.value), powers(basis.slope), powers(basis.curvature), reach, sigma)


def _horner(powers: Array, t: Array) -> Array:
    """Polynomial at t; every intermediate is used once, so that it compiles to one loop."""
    value = powers[-1] * jnp.ones_like(t)
    for k in range(powers.shape[0] - 2, -1, -1):
        value = value * t + powers[k]
    return value
