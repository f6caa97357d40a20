"""The Gaussian proposal around an optimum from the curvature of the log-posterior itself.

A search makes its steps with the information matrix, which leaves out how the simulation bends
and holds the noise levels. Where a model misses something, that proposal is several times too wide:
here it is taken from differences of the log-posterior over one standard deviation, so that it
also takes in how the posterior bends between there and the optimum.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from rigid.inference.coordinates import Chart
from rigid.inference.search import Found, Optimum
from rigid.likelihood.problem import log_density

STEP = 1.0
"""Of the differences, in standard deviations of the proposal known so far."""
LEAST, MOST = 0.04, 400.0
"""Curvatures are kept between these, as multiples of that of the proposal known so far."""

Density = Callable[[np.ndarray], np.ndarray]


def sharpened(found: Found, chart: Chart) -> Found:
    """Return a search with the proposal around each optimum made anew, best optimum first."""
    density = chart.density(lambda z: log_density(found.problem, z))
    optima = [
        chart.standardised(_stepped(density, chart.straightened(optimum)))
        for optimum in found.optima
    ]
    return dataclasses.replace(
        found, optima=tuple(sorted(optima, key=lambda one: -one.log_posterior))
    )


def _stepped(density: Density, optimum: Optimum) -> Optimum:
    factor = np.linalg.cholesky(optimum.covariance)
    with np.errstate(invalid="ignore"):  # no difference to a point without a value
        value, slope, bend = differences(density, optimum.z, factor)
    if not np.all(np.isfinite(bend)):  # a point next to the optimum cannot be simulated
        return optimum
    curvature, axes = np.linalg.eigh(bend)
    curvature = np.clip(curvature, LEAST, MOST)
    covariance = factor @ (axes / curvature) @ axes.T @ factor.T
    step = factor @ (axes @ ((axes.T @ slope) / curvature))
    # Half of the step and less, too: the proposal is Gaussian nearly, not quite.
    shares = np.array([1.0, 0.5, 0.25])
    tried = density(optimum.z + shares[:, None] * step)
    best = int(np.argmax(np.where(np.isfinite(tried), tried, -np.inf)))
    z, level = optimum.z, value
    if tried[best] > value:
        z, level = optimum.z + shares[best] * step, float(tried[best])
    return dataclasses.replace(optimum, z=z, covariance=covariance, log_posterior=level)


def differences(
    density: Density, z: np.ndarray, factor: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Value at z (d,), slope (d,) and minus the Hessian (d, d) of a density, by differences.

    - `density`: (n, d) -> (n,), logarithmic. - `factor` (d, d): its columns are the unit vectors.

    The mixed differences are those of both signs at once: exact for a polynomial of third degree.
    """
    d = len(z)
    first, second = np.triu_indices(d, 1)
    single = STEP * factor.T
    pairs = single[first] + single[second]
    out = density(z + np.concatenate([np.zeros((1, d)), single, -single, pairs, -pairs]))
    value = float(out[0])
    up, down = out[1 : d + 1], out[d + 1 : 2 * d + 1]
    both, neither = np.split(out[2 * d + 1 :], 2)
    bend = np.diag(2.0 * value - up - down)
    mixed = up[first] + down[first] + up[second] + down[second] - 2.0 * value - both - neither
    bend[first, second] = bend[second, first] = 0.5 * mixed
    return value, 0.5 * (up - down) / STEP, bend / STEP**2
