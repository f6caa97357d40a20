"""The evidence of a law from the parabola around its fit.

Laplace's method takes the log-likelihood for a parabola in the numbers' standard scale. Where the
records say no more of an amplitude than that it is small, the likelihood is a parabola in the
amplitude but no such thing in its logarithm; Laplace's integral is then off by up to half a nat. So
amplitudes that the records leave wide are integrated over on a grid of their prior, all other
numbers by the parabola: exact where records change in proportion to an amplitude.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp

from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.candidates import standard_of
from rigid.localfit.local import LocalFit

WIDE = 0.25
"""Sd of an amplitude, on the standard scale of its prior, from which on it goes by the grid."""
MOST_WIDE = 2
"""Amplitudes that share a grid, at most; the widest."""
GRID = np.linspace(-7.0, 7.0, 121)
LOG_MASS = -0.5 * GRID**2 - np.asarray(logsumexp(-0.5 * GRID**2))


@dataclasses.dataclass(frozen=True)
class Shape:
    """How the prior of a law meets a log-likelihood that is known as a parabola around w.

    - `information` (d, d): minus the Hessian of the log-likelihood. - `centre`, `slope` (d,): the
      standard scale of the prior runs through centre + slope (w' - w). - `wide` (m,): amplitudes
      on the grid. - `steps` (m, k): how far each point of the grid is from w, in proportion to the
      amplitude. - `log_mass` (k,): of the prior there.
    """

    information: np.ndarray
    centre: np.ndarray
    slope: np.ndarray
    wide: np.ndarray
    steps: np.ndarray
    log_mass: np.ndarray

    def integral(self, gradient: np.ndarray, value: np.ndarray | float) -> np.ndarray:
        """Log of the integral of likelihood times prior.

        - `gradient` (..., d), `value` (...): slope of the log-likelihood at w, and itself.
        """
        other, slope = self._other, self.slope[self._other]
        asked = gradient[..., other] - slope * self.centre[other]
        moved = cho_solve(self._solved, asked.reshape(-1, len(other)).T).T.reshape(asked.shape)
        top = value + 0.5 * np.sum(asked * moved, axis=-1) + self._level
        if not len(self.wide):
            return np.asarray(top)
        free = gradient[..., self.wide] - moved @ self._cross.T
        return np.asarray(top + log_sum(free @ self.steps + self._curve))

    @cached_property
    def _other(self) -> np.ndarray:
        """Numbers that are not on the grid."""
        return np.setdiff1d(np.arange(len(self.centre)), self.wide)

    @cached_property
    def _solved(self) -> tuple[np.ndarray, bool]:
        """Factor of the posterior's information on them."""
        own = self.information[np.ix_(self._other, self._other)]
        return cho_factor(own + np.diag(self.slope[self._other] ** 2))

    @cached_property
    def _level(self) -> float:
        """What the integral has whatever the samples are."""
        slope, centre = self.slope[self._other], self.centre[self._other]
        size = np.log(slope).sum() - np.log(np.diag(self._solved[0])).sum()
        return float(size - 0.5 * centre @ centre)

    @cached_property
    def _cross(self) -> np.ndarray:
        return self.information[np.ix_(self.wide, self._other)]

    @cached_property
    def _curve(self) -> np.ndarray:
        """Log of the integrand on the grid (k,) but for the slope there, the rest at its best."""
        own = self.information[np.ix_(self.wide, self.wide)]
        curvature = own - self._cross @ cho_solve(self._solved, self._cross.T)
        return self.log_mass - 0.5 * np.einsum("mk,mn,nk->k", self.steps, curvature, self.steps)

    def without(self, information: np.ndarray) -> "Shape":
        """Return the shape with less to go by: that of some samples taken off."""
        return dataclasses.replace(self, information=self.information - information)


def log_sum(height: np.ndarray) -> np.ndarray:
    """Log of the sum of exponentials over the last axis; a third of the time of scipy's."""
    top = height.max(axis=-1, keepdims=True)
    return np.asarray(top[..., 0] + np.log(np.exp(height - top).sum(axis=-1)))


class Amplitude(NamedTuple):
    """An amplitude where a law was fitted.

    - `place`: its entry of w. - `value`: there; `rise`: its slope by w. - `prior`: which
      need not be the one that w was made with.
    """

    place: int
    value: float
    rise: float
    prior: AbstractPrior


def shape_of(
    local: LocalFit, amplitudes: Mapping[str, AbstractPrior], curvature: np.ndarray | None = None
) -> Shape:
    """The shape of a law's evidence around its fit.

    - `amplitudes`: priors of its amplitudes, by label; they may be others than it was fitted with.
    - `curvature` (n,): minus the curvature of each sample, in place of the fit's.
    """
    values, labels = local.hypothesis.values(local.w), local.hypothesis.labels
    listed = [
        Amplitude(labels.index(label), *values[label], prior) for label, prior in amplitudes.items()
    ]
    if curvature is None:
        return shape(local.information - np.eye(len(local.w)), local.w, listed)
    return shape(local.design.T @ (local.design * curvature[:, None]), local.w, listed)


def shape(information: np.ndarray, w: np.ndarray, amplitudes: Sequence[Amplitude]) -> Shape:
    """The shape where a log-likelihood has `information` (d, d) around w (d,)."""
    sd = np.sqrt(np.diag(np.linalg.inv(information + np.eye(len(w)))))
    open_ = sorted((a for a in amplitudes if sd[a.place] > WIDE), key=lambda a: -sd[a.place])
    centre, slope, steps = w.copy(), np.ones(len(w)), []
    for one in amplitudes:
        if one in open_[:MOST_WIDE]:
            grid = np.asarray(one.prior.from_standard(GRID))
            steps.append((one.place, (grid - one.value) / one.rise))
            continue
        z = standard_of(one.prior, one.value)
        _, rise = jax.jvp(one.prior.from_standard, (jnp.asarray(z),), (jnp.ones(()),))
        centre[one.place], slope[one.place] = z, one.rise / float(rise)
    wide = np.array([i for i, _ in steps], dtype=int)
    grids = np.meshgrid(*[s for _, s in steps], indexing="ij")
    masses = np.meshgrid(*[LOG_MASS] * len(steps), indexing="ij")
    mass = sum((m.ravel() for m in masses), start=np.zeros(GRID.size ** len(steps)))
    flat = np.array([g.ravel() for g in grids]).reshape(len(steps), mass.size)
    return Shape(information, centre, slope, wide, flat, mass)


def evidence(local: LocalFit, amplitudes: Mapping[str, AbstractPrior]) -> float:
    """Log evidence of a law from its fit, with `amplitudes` as in `shape_of`."""
    gradient = local.design.T @ local.terms.score
    value = local.terms.value.sum() - 0.5 * local.z_noise @ local.z_noise
    return float(shape_of(local, amplitudes).integral(gradient, value))
