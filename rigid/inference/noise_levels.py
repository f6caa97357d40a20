"""The most probable noise levels of the sensors, all else held."""

import numpy as np

from rigid.inference.newton import is_noise
from rigid.likelihood.problem import Problem, log_density

NOISE_STEP = 0.1
NOISE_ITERATIONS = 4


def noise_curvature(problem: Problem, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope and minus the curvature of the log-posterior along each noise level, by differences."""
    noise = np.flatnonzero(is_noise(problem))
    step = np.zeros((2 * len(noise) + 1, len(z)))
    rows = np.arange(len(noise))
    step[2 * rows + 1, noise], step[2 * rows + 2, noise] = NOISE_STEP, -NOISE_STEP
    value = log_density(problem, z + step)
    up, down = value[1::2], value[2::2]
    return (up - down) / (2 * NOISE_STEP), -(up - 2 * value[0] + down) / NOISE_STEP**2


def noise_gain(problem: Problem, z: np.ndarray) -> float:
    """Nats that the log-posterior still rises by where the noise levels alone are moved."""
    slope, bend = noise_curvature(problem, z)
    return float(0.5 * np.sum(slope**2 / np.maximum(bend, 1.0)))


def fit_noise(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Move the noise levels in z to their most probable values, the rest held, by Newton steps."""
    noise = is_noise(problem)
    z = z.copy()
    for _ in range(NOISE_ITERATIONS):
        slope, bend = noise_curvature(problem, z)
        z[noise] += np.clip(slope / np.maximum(bend, 1.0), -1.0, 1.0)
    return z
