"""A hypothesis expanded around a point: readings, residuals, likelihood and slopes of all samples.

Only readings and slopes come from the compiled programs (`rigid.localfit.expansion`); likelihood,
steps and evidence are linear algebra on the list of samples.
"""

import dataclasses
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from rigid.io.compiled import compiled
from rigid.likelihood.channels import SensorSheet
from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.families import Family
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.samples import Layout, Terms, terms

Z_90 = 1.6448536269514722
"""95 % quantile of the standard normal."""
LOWEST, LEVELS = -5.0, 25
"""Least noise level that is tried, in prior sds; how many at a time."""
LOUDEST, LOUDER = 5.0, 31.0
"""Greatest ones: where something may be missing that must not pass for noise, and where a model
that lacks much is to come near its records."""


@dataclasses.dataclass(frozen=True)
class LocalFit:
    """A hypothesis at w, and all that is known of the samples there.

    - `residual` (n,): recorded less expected; `reading` (n,): ideal. - `terms`: the likelihood.
    - `design` (n, size): slope of the expected reading by w.
    """

    hypothesis: Hypothesis
    family: Family
    layout: Layout
    w: Float[np.ndarray, " size"]
    z_noise: Float[np.ndarray, " levels"]
    reading: Float[np.ndarray, " n"]
    residual: Float[np.ndarray, " n"]
    terms: Terms
    design: Float[np.ndarray, "n size"]

    @cached_property
    def value(self) -> float:
        """Log-posterior, up to a constant that all hypotheses share."""
        prior = 0.5 * (self.w @ self.w + self.z_noise @ self.z_noise)
        return float(self.terms.value.sum() - prior)

    @cached_property
    def finite(self) -> bool:
        """Whether its records could be simulated here, and how they change with w.

        Slopes whose squares are no numbers any more leave no information to go on by.
        """
        squares = np.einsum("nk,nk,n->", self.design, self.design, self.terms.curvature)
        return bool(np.isfinite(self.value) and np.isfinite(squares))

    @cached_property
    def information(self) -> Float[np.ndarray, "size size"]:
        """Minus the Hessian of the log-posterior by w, prior included (size, size)."""
        weighted = self.design * self.terms.curvature[:, None]
        return np.eye(len(self.w)) + self.design.T @ weighted

    @cached_property
    def gradient(self) -> Float[np.ndarray, " size"]:
        """Slope of the log-posterior by w (size,)."""
        return self.design.T @ self.terms.score - self.w

    @cached_property
    def covariance(self) -> Float[np.ndarray, "size size"]:
        """Of the Gaussian law around w (size, size)."""
        return cho_solve(cho_factor(self.information), np.eye(len(self.w)))

    @cached_property
    def log_evidence(self) -> float:
        """Log of the integral of the posterior by Laplace's method, noise levels at their best."""
        return self.value - 0.5 * float(np.linalg.slogdet(self.information)[1])

    def given_way(self, change: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """What is left of a change of expected readings once the fit has given way to it."""
        gradient = self.design.T @ (self.terms.curvature * change)
        return change - self.design @ np.linalg.solve(self.information, gradient)

    def gain_of(self, change: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Log-likelihood that each sample gains by a change of expected readings."""
        return self.terms.score * change - 0.5 * self.terms.curvature * change**2

    def interval(self, label: str) -> dict[str, Any]:
        """Median, 90 % interval and unit of a parameter, by the Gaussian around w."""
        number = self.hypothesis.labels.index(label)
        parameter = self.hypothesis.parameters[number]
        reach = Z_90 * float(np.sqrt(self.covariance[number, number]))
        places = self.w[number] + np.array([-reach, 0.0, reach])
        # priors of negative quantities fall
        low, median, high = sorted(float(parameter.prior.from_standard(z)) for z in places)
        return {"median": median, "q05": low, "q95": high, "unit": parameter.unit}


@compiled
def levels_of(sheet: SensorSheet, residual: Array, weight: Array, sigma: Array) -> Array:
    """Log-likelihood of a channel's samples (n,) for several noise levels (levels,)."""
    return weight @ sheet.noise_model(sigma)(residual[:, None]).value


def fitted_noise(local: LocalFit, loudest: float = LOUDEST) -> np.ndarray:
    """Most probable noise levels, on the scale of their priors (levels,), the rest held.

    - `loudest`: greatest level.
    """
    listed = local.layout.problem.parameters.sampled
    priors = {p.label: p.prior for p in listed if p.base == "noise"}
    middle, reach = 0.5 * (LOWEST + loudest), 0.5 * (loudest - LOWEST)
    peaks = dict.fromkeys(priors, middle)
    for wide in (reach, 0.1 * reach):
        levels = {
            label: np.clip(at, LOWEST + wide, loudest - wide) + np.linspace(-wide, wide, LEVELS)
            for label, at in peaks.items()
        }
        height = _heights(local, priors, levels)
        peaks = {label: peak(levels[label], height[label]) for label in priors}
    return np.array(list(peaks.values()))


def _heights(
    local: LocalFit, priors: Mapping[str, AbstractPrior], levels: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Log-posterior of each noise level, on the scale of its prior, the rest held."""
    problem, layout = local.layout.problem, local.layout
    total = {label: -0.5 * each**2 for label, each in levels.items()}
    sheets = [piece.sheet for piece in problem.pieces for _ in piece.tracks]
    for number, (channel, sheet) in enumerate(zip(layout.channels, sheets, strict=True)):
        label = f"noise[{channel.sensor}]"
        if label in priors:
            rows = layout.channel == number
            sigma = priors[label].from_standard(jnp.asarray(levels[label]))
            residual, weight = jnp.asarray(local.residual[rows]), jnp.asarray(layout.weight[rows])
            total[label] = total[label] + np.asarray(levels_of(sheet, residual, weight, sigma))
    return total


def peak(levels: np.ndarray, height: np.ndarray) -> float:
    """Place of the peak of a curve over even levels, by a parabola through its top."""
    i = int(np.clip(np.argmax(height), 1, len(height) - 2))
    left, top, right = height[i - 1 : i + 2]
    curvature = left - 2.0 * top + right
    shift = 0.5 * (left - right) / curvature if curvature < 0.0 else 0.0
    at = levels[i] + np.clip(shift, -1.0, 1.0) * (levels[1] - levels[0])
    return float(np.clip(at, levels[0], levels[-1]))


def with_noise(local: LocalFit, z_noise: np.ndarray) -> LocalFit:
    """Return the same fit with other noise levels."""
    return _again(local, local.layout, z_noise)


def with_weights(local: LocalFit, weight: np.ndarray) -> LocalFit:
    """Return the same fit with other weights of the samples (n,)."""
    return _again(local, local.layout.weighed(weight), local.z_noise)


def _again(local: LocalFit, layout: Layout, z_noise: np.ndarray) -> LocalFit:
    found = terms(layout, local.residual, local.hypothesis.sigmas(z_noise))
    return dataclasses.replace(local, layout=layout, z_noise=z_noise, terms=found)
