"""Likelihood of what was read: noise, converter, gain and zero of the sensors.

A sample that the converter rounded to a code is the interval of the values that round to it; its
likelihood is the probability of that interval. Gain and zero of a sensor are integrated out: the
log-likelihood is concave in both, and with thousands of samples Gaussian around its maximum
(Laplace). Its maximum is that of least squares and a Newton step, or of more where noise is small
against the converter's step (`rigid.likelihood.marginal`).
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.likelihood.quantisation import Point, curve, nodes_of

LOG_SQRT_2PI = 0.9189385332046727
FINE_STEP = 0.25
"""Converters finer than this many noise sd are taken as Gaussian of variance sigma^2 + step^2/12;
the next term of the expansion is (step/sigma)^4/2880 < 2e-6 of a sample's information."""


def gaussian(residual: Array, sigma: Array, step: float | Array) -> Point:
    """Log-probability of a finely converted sample: the density times the step, or the density.

    - `step`: of the converter; 0 gives a density in the unit of `residual`.
    """
    variance = sigma**2 + step**2 / 12.0
    wide = jnp.log(jnp.where(step > 0.0, step, 1.0))
    value = -0.5 * residual**2 / variance - 0.5 * jnp.log(variance) - LOG_SQRT_2PI + wide
    return Point(value, residual / variance, -1.0 / variance + 0.0 * residual)


def rounding(step: float, sheet_noise: float) -> int:
    """From how many exact values the law of a rounded sample is interpolated.

    0 where a converter's step does not count against the noise of the sensor's sheet: there a
    sample has a density.
    """
    return nodes_of(step, sheet_noise) if step > FINE_STEP * sheet_noise else 0


def sample_law(sigma: Array, step: float | Array, nodes: int) -> Callable[[Array], Point]:
    """Return the log-probability of samples as a function of their residuals.

    - `sigma`: noise, `step`: of the converter, in the unit of the residuals. - `nodes`: as
      `rounding` tells: 0 where a sample has a density, else it is an interval.
    """
    return curve(sigma, step, nodes) if nodes else partial(gaussian, sigma=sigma, step=step)


class Sums(NamedTuple):
    """Least-squares sums over the samples of a sensor: weights, readings, residuals, products."""

    one: Array
    m: Array
    mm: Array
    r: Array
    rm: Array


class Calibration(NamedTuple):
    """Correction of a sensor: it reads (1 + gain) times the true value plus zero."""

    gain: Array
    zero: Array


class Spread(NamedTuple):
    """Prior standard deviations of gain [-] and zero [SI] of a sensor; 0 where it is exact."""

    gain: float
    zero: float


class Spreads(NamedTuple):
    """The same of several sensors, (sensors, 1) each."""

    gain: Array
    zero: Array


def least_squares(sums: Sums, spread: Spread | Spreads) -> Calibration:
    """Most probable gain and zero if noise and rounding were Gaussian, in closed form."""
    # In units of the spreads, where a spread of 0 is nothing special.
    by_gain, by_zero = spread.gain * sums.rm, spread.zero * sums.r
    a, b, c = _curvatures(sums.mm, sums.m, sums.one, spread)
    determinant = a * c - b * b
    return Calibration(
        spread.gain * (c * by_gain - b * by_zero) / determinant,
        spread.zero * (a * by_zero - b * by_gain) / determinant,
    )


def _curvatures(
    gain: Array, both: Array, zero: Array, spread: Spread | Spreads
) -> tuple[Array, ...]:
    """Minus the Hessian of likelihood and prior in gain and zero over their spreads.

    - `gain`, `both`, `zero`: that of the likelihood in SI.
    """
    return (
        gain * spread.gain**2 + 1.0,
        both * spread.gain * spread.zero,
        zero * spread.zero**2 + 1.0,
    )


def _over(value: Array, sd: float | Array) -> Array:
    """Value in standard deviations; one that is exact is 0."""
    uncertain = jnp.asarray(sd) > 0.0
    return jnp.where(uncertain, value, 0.0) / jnp.where(uncertain, sd, 1.0)


class Quadratic(NamedTuple):
    """Log-likelihood of a sensor around a calibration: value, gradient, minus the Hessian."""

    value: Array
    g_gain: Array
    g_zero: Array
    h_gain: Array
    h_both: Array
    h_zero: Array


def total(terms: Array) -> Array:
    """Sum over the first axis, as a product with ones.

    XLA fuses a plain sum with what it adds up into a loop that is not vectorised, five times
    slower here.
    """
    return jnp.tensordot(jnp.ones(terms.shape[0]), terms, 1)


def moments(data: Array, weight: Array, reading: Array) -> Sums:
    """Least-squares sums of samples over the first axis."""
    r, wm = data - reading, weight * reading
    return Sums(total(weight), total(wm), total(wm * reading), total(weight * r), total(wm * r))


def quadratic(
    law: Callable[[Array], Point],
    gain: Array,
    zero: Array,
    data: Array,
    weight: Array,
    reading: Array,
) -> Quadratic:
    """Sum samples over the first axis into an expansion in gain and zero around given ones."""
    residual = data - (1.0 + gain) * reading - zero
    # A branch keeps the point: XLA would work it out anew for each of the sums.
    nothing = Point(*(jnp.zeros_like(residual) for _ in Point._fields))
    point = jax.lax.cond(jnp.any(weight > 0.0), lambda r: law(r), lambda _: nothing, residual)
    slope, bend = weight * point.slope, -weight * point.curvature
    return Quadratic(
        total(weight * point.value),
        total(slope * reading),
        total(slope),
        total(bend * reading * reading),
        total(bend * reading),
        total(bend),
    )


class Marginal(NamedTuple):
    """Log-likelihood with gain and zero integrated out, and their Gaussian law.

    - `value`: the integral's logarithm. - `best`: most probable calibration.
    - `var_gain`, `covariance`, `var_zero`: of the law around it.
    """

    value: Array
    best: Calibration
    var_gain: Array
    covariance: Array
    var_zero: Array


class Step(NamedTuple):
    """A Newton step of gain and zero: by how much, and the nats that an expansion promises for it.

    - `var_gain`, `covariance`, `var_zero`: of the Gaussian law around where it leads.
    """

    by: Calibration
    promise: Array
    var_gain: Array
    covariance: Array
    var_zero: Array


def step(expansion: Quadratic, at: Calibration, spread: Spread | Spreads) -> Step:
    """Step from `at` to where an expansion around it, the prior included, has its maximum."""
    g_gain = spread.gain * expansion.g_gain - _over(at.gain, spread.gain)
    g_zero = spread.zero * expansion.g_zero - _over(at.zero, spread.zero)
    a, b, c = _curvatures(expansion.h_gain, expansion.h_both, expansion.h_zero, spread)
    determinant = a * c - b * b
    d_gain = (c * g_gain - b * g_zero) / determinant
    d_zero = (a * g_zero - b * g_gain) / determinant
    return Step(
        Calibration(spread.gain * d_gain, spread.zero * d_zero),
        0.5 * (g_gain * d_gain + g_zero * d_zero),
        spread.gain**2 * c / determinant,
        -spread.gain * spread.zero * b / determinant,
        spread.zero**2 * a / determinant,
    )


def drift_of_top(
    expansion: Quadratic, change: Quadratic, at: Calibration, spread: Spread | Spreads
) -> Calibration:
    """Return how fast the maximum of an expansion around `at` moves.

    - `change`: of the expansion around the same gain and zero; its gradient moves the maximum by
      minus the inverse of the Hessian times as much.
    """
    law = step(expansion, at, spread)
    return Calibration(
        law.var_gain * change.g_gain + law.covariance * change.g_zero,
        law.covariance * change.g_gain + law.var_zero * change.g_zero,
    )


def with_prior(expansion: Quadratic, at: Calibration, spread: Spread | Spreads) -> Array:
    """Log-likelihood at `at` plus the log of the prior there, but for a constant."""
    gain, zero = _over(at.gain, spread.gain), _over(at.zero, spread.zero)
    return expansion.value - 0.5 * (gain**2 + zero**2)


def marginal(expansion: Quadratic, at: Calibration, spread: Spread | Spreads) -> Marginal:
    """Integrate gain and zero out of an expansion around `at` by Laplace's method.

    A last Newton step leads from `at` to the maximum; the value there is that of the expansion.
    """
    last = step(expansion, at, spread)
    a, b, c = _curvatures(expansion.h_gain, expansion.h_both, expansion.h_zero, spread)
    value = with_prior(expansion, at, spread) + last.promise - 0.5 * jnp.log(a * c - b * b)
    best = Calibration(at.gain + last.by.gain, at.zero + last.by.zero)
    return Marginal(value, best, last.var_gain, last.covariance, last.var_zero)
