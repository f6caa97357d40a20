"""Readings of a converter as Gaussians.

The first guess is the code itself with variance sigma^2 + step^2/12. Then, at the smoothed reading
m, the logarithm of the interval's probability is laid out to second order: its slope and curvature
are those of a Gaussian at m - slope/curvature with variance -1/curvature. For a plunger at rest
between two codes the first guess is off by up to a tenth of a step, the second is not.
"""

import jax.numpy as jnp
import numpy as np

from rigid.likelihood.quantisation import interval

REACH = 4.0
"""Sds of noise, beyond half a step, to which the expansion point is held."""


def plain(codes: np.ndarray, sigma: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Variance of each reading, (samples, channels), as if rounding were Gaussian [SI^2]."""
    variance = np.square(sigma) + np.square(step) / 12.0
    return np.broadcast_to(variance, codes.shape).copy()


def expanded(
    codes: np.ndarray, read: np.ndarray, sigma: np.ndarray, step: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gaussian readings and variances (samples, channels) from codes and smoothed readings [SI].

    Sensors whose step is below a quarter of their noise stay as they are.
    """
    reading, variance = codes.copy(), plain(codes, sigma, step)
    for i, (s, d) in enumerate(zip(sigma, step, strict=True)):
        if d < 0.25 * s:
            continue
        most = 0.5 * d + REACH * s
        residual = np.clip(codes[:, i] - read[:, i], -most, most)
        point = interval(jnp.asarray(residual), jnp.asarray(s), d)
        # `slope` is by the expected reading.
        slope, curvature = np.asarray(point.slope), np.asarray(point.curvature)
        curvature = np.minimum(curvature, -1e-3 / s**2)
        reading[:, i] = codes[:, i] - residual - slope / curvature
        variance[:, i] = -1.0 / curvature
    return reading, variance
