"""S p / v in free running: its probability under a cause, in closed form.

In logarithms all that enters is Gaussian: a number common to both cylinders, what a cylinder
differs by, the borrowed speed, and the reading. So the density of the two printed values and the
law of the common number given them are those of Gaussians; viscous friction of the release, which
adds to any force, is taken off first (a change of variables).
"""

import numpy as np
from jaxtyping import Float

from rigid.published.catalogue import TRANSFER
from rigid.published.quantities import running_speed
from rigid.published.story import Cause
from rigid.spec import Printed, PublishedSpec


def _relative(printed: Printed) -> float:
    """Relative sd of a printed number: reading and rounding."""
    return float(np.hypot(printed.sd, printed.half_width / np.sqrt(3.0)) / printed.value)


def _spread(cause: Cause, prior: str, published: PublishedSpec) -> np.ndarray:
    """Variance of log x of A and B around the common number, (2,)."""
    variance = np.array([_relative(published.mu_A), _relative(published.mu_B)]) ** 2
    variance = variance + np.log(cause.spread[prior]) ** 2
    if cause.speed:
        borrowed = np.array([_relative(published.kappa_A), _relative(published.kappa_B)]) ** 2
        variance = variance + borrowed + np.log(TRANSFER[prior]) ** 2
    return variance


def _per_unit(cause: Cause, published: PublishedSpec) -> np.ndarray:
    """log of S p / v of A and B for a common number of 1, (2,)."""
    if not cause.speed:
        return np.full(2, np.log(cause.scale))
    fractions = (published.kappa_A.value, published.kappa_B.value)
    return np.log(cause.scale / np.array([running_speed(k) for k in fractions]))


def _rest(cause: Cause, friction: np.ndarray, published: PublishedSpec) -> tuple:
    """log of what is left of the printed values for the cause, and the log Jacobian, (n, 2)."""
    seen = np.array([published.mu_A.value, published.mu_B.value])
    if not cause.parameter:
        return np.log(seen) - np.log(friction)[:, None], np.zeros((len(friction), 2))
    left = seen - friction[:, None]
    kept = np.maximum(left, 1e-9 * seen)
    jacobian = np.where(left > 0.0, np.log(seen) - np.log(kept), -np.inf)
    return np.log(kept) - _per_unit(cause, published), jacobian


def log_density(
    cause: Cause, prior: str, friction: Float[np.ndarray, " n"], published: PublishedSpec
) -> Float[np.ndarray, " n"]:
    """Log density of log mu_A and log mu_B as printed, (n,).

    - `friction` [N s/m]: of the release in steady running.
    """
    rest, jacobian = _rest(cause, friction, published)
    median, factor = cause.prior[prior]
    covariance = np.diag(_spread(cause, prior, published)) + np.log(factor) ** 2
    off = rest - np.log(median)
    solved = np.linalg.solve(covariance, off.T).T
    quadratic = np.sum(off * solved, axis=1)
    return -0.5 * (quadratic + np.linalg.slogdet(2.0 * np.pi * covariance)[1]) + jacobian.sum(
        axis=1
    )


def common_given(
    cause: Cause, prior: str, friction: np.ndarray, published: PublishedSpec, normal: np.ndarray
) -> np.ndarray:
    """Draws (n,) of the common number given both printed values; `normal` (n,) standard normal."""
    rest, _ = _rest(cause, friction, published)
    median, factor = cause.prior[prior]
    precision = 1.0 / _spread(cause, prior, published)
    own = 1.0 / np.log(factor) ** 2
    total = own + precision.sum()
    mean = (own * np.log(median) + rest @ precision) / total
    return np.exp(mean + normal / np.sqrt(total))


def sliding_force(published: PublishedSpec) -> dict[str, tuple[float, float]]:
    """By cylinder: speed [m/s] at the borrowed kappa, and S p [N] that the printed mu means."""
    pairs = {
        "A": (published.kappa_A, published.mu_A),
        "B": (published.kappa_B, published.mu_B),
    }
    speeds = {name: running_speed(k.value) for name, (k, _) in pairs.items()}
    return {name: (speeds[name], m.value * speeds[name]) for name, (_, m) in pairs.items()}
