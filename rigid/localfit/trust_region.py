"""The step of a fit: to the top of what its parabola and the priors say, within a radius.

Readings change in proportion to an amplitude, not to its logarithm. Where two amplitudes share what
the records know of them (a coefficient and its branches: the sum of both, to a thousandth), the top
lies along a valley that is straight in the amplitudes and bent in their logarithms, a thousandth
wide: steps along its tangent leave it after a twentieth of a prior sd. So the log-likelihood is
taken for a parabola in the amplitudes, the prior is what it is, and the top of both is found
without a simulation.

Other valleys bend, too: k_oil/(L_0 + x) is what records know, and both of its numbers may have to
go far together. How readings bend along the way is known from the last step, since slopes were
simulated at both of its ends; the next one is bent after it (geodesic acceleration: Transtrum and
Sethna 2012, arXiv:1201.5885, whose second derivative is one more simulation).
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from rigid.likelihood.priors import Lognormal
from rigid.localfit.local import LocalFit

FIRST_DAMPING, MORE_DAMPING = 0.1, 4.0
"""Damping that is tried first, in units of the prior's curvature, and the factor to the next."""
ENOUGH_OF_IT, LEAST_DAMPING = 0.75, 1e-5
"""Share of the length that is allowed to a step from which on it is long enough, and damping below
which no less is tried."""
MOST_ROUNDS = 60
ENOUGH = 1e-4
"""Nats that a round must promise to be done."""
TO_ZERO = 0.9
"""Share of the way to an amplitude of zero that one round may go."""
HALVINGS = 30
BENT = 0.75
"""A step is bent by no more than this share of its length; where it would be by more, the last step
tells nothing of it."""
TRACE = 1e-12
"""Added to the diagonal of what is solved, in units of it; rounding takes off 1e-14."""


class Pull(NamedTuple):
    """What the bend of the last step does to the gradient of the log-likelihood.

    - `along` (size,): that step. - `by` (size,): twice what the gradient lacks, for the bend, where
      another step like it ends.
    """

    along: np.ndarray
    by: np.ndarray


class Bend(NamedTuple):
    """How expected readings bend along the last step.

    - `along` (size,): that step, as `Model` has steps, seen from its end. - `by` (n,): second
      derivative of the readings along it.
    """

    along: np.ndarray
    by: np.ndarray

    @classmethod
    def between(cls, last: LocalFit, local: LocalFit) -> "Bend":
        """Return it from slopes at both ends of a step."""
        log_factors = log_factors_of(last)
        bent = log_factors > 0.0
        unit = np.where(bent, log_factors, 1.0)
        moved = local.w - last.w
        step = np.where(bent, np.expm1(unit * moved) / unit, moved)
        grown = np.where(bent, 1.0 + log_factors * step, 1.0)
        return cls(step / grown, local.design @ (step / grown) - last.design @ step)

    def pull(self, local: LocalFit) -> Pull | None:
        """What it does to the gradient of the fit at its end; None where nothing moved."""
        if not np.any(self.along):
            return None
        return Pull(self.along, local.design.T @ (local.terms.curvature * self.by))


@dataclasses.dataclass(frozen=True)
class Model:
    """Log-posterior around a fit, likelihood a parabola in d = change of value / its slope by w.

    - `information` (size, size), `gradient` (size,): of the likelihood. - `w` (size,): where it
      stands.
    - `log_factors` (size,): ln of the factor of a lognormal amplitude, w + ln(1 + log_factors
      d)/log_factors; 0 for all other numbers, w + d.
    - `pull`: by which a step is bent; None where nothing tells it.
    """

    information: np.ndarray
    gradient: np.ndarray
    w: np.ndarray
    log_factors: np.ndarray
    pull: Pull | None = None

    def bent(self, d: np.ndarray, damping: float) -> np.ndarray:
        """A step d (size,), bent as far as the last one tells."""
        if self.pull is None:
            return d
        along, by = self.pull
        share = float(d @ along) / float(along @ along)
        held = (1.0 + damping) * np.eye(len(d))
        aside = -0.5 * share**2 * solved(self.information + held, by)
        sharp = np.abs(aside).max() > BENT * np.abs(d).max()
        gone = np.any(self.log_factors * (d + aside) <= -TO_ZERO)
        return d if sharp or gone else d + aside

    def place(self, d: np.ndarray) -> np.ndarray:
        """w (size,) there."""
        log_factors = np.where(self.log_factors > 0.0, self.log_factors, 1.0)
        return self.w + np.where(
            self.log_factors > 0.0, np.log1p(self.log_factors * d) / log_factors, d
        )

    def length(self, d: np.ndarray) -> float:
        """Largest change of an entry of w."""
        return float(np.abs(self.place(d) - self.w).max())

    def value(self, d: np.ndarray, damping: float = 0.0) -> float:
        """Log-posterior there, less `damping` |change of w|^2/2, up to a constant."""
        w = self.place(d)
        moved = w - self.w
        prior = 0.5 * (w @ w + damping * moved @ moved)
        return float(self.gradient @ d - 0.5 * d @ self.information @ d - prior)

    def top(self, damping: float, begin: np.ndarray) -> np.ndarray:
        """d (size,) at which `value` is highest, from `begin` on.

        Newton's method; where the prior of an amplitude bends the wrong way, it is left out.
        """
        d = begin
        for _ in range(MOST_ROUNDS):
            w, rise = self.place(d), 1.0 / (1.0 + self.log_factors * d)
            held = w + damping * (w - self.w)
            slope = self.gradient - self.information @ d - held * rise
            curvature = (1.0 + damping) * rise**2 + np.maximum(
                -held * self.log_factors * rise**2, 0.0
            )
            step = solved(self.information + np.diag(curvature), slope)
            if slope @ step < ENOUGH:
                break
            low = np.minimum(self.log_factors * step * rise, 0.0).min(initial=0.0)
            step = step * min(1.0, TO_ZERO / max(-low, 1e-300))
            d = self._uphill(d, step, damping)
        return d

    def _uphill(self, d: np.ndarray, step: np.ndarray, damping: float) -> np.ndarray:
        here = self.value(d, damping)
        for _ in range(HALVINGS):
            if self.value(d + step, damping) > here:
                return d + step
            step = 0.5 * step
        return d


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution (size,) for a matrix that is positive definite but for what rounding does.

    Scaled to a diagonal of 1, to which TRACE is added: far from the top records seem to know some
    sums of numbers to 1e-8 of a prior sd, beside which nothing of the prior is left in 16 digits.
    """
    scale = 1.0 / np.sqrt(np.diag(matrix))
    unit = matrix * np.outer(scale, scale) + TRACE * np.eye(len(scale))
    return scale * cho_solve(cho_factor(unit), scale * right)


def model_of(local: LocalFit, bend: Bend | None = None) -> Model:
    """The model of a fit's log-posterior around where it stands.

    - `bend`: of the step that led there.
    """
    information = local.information - np.eye(len(local.w))
    pull = None if bend is None else bend.pull(local)
    return Model(information, local.gradient + local.w, local.w, log_factors_of(local), pull)


def log_factors_of(local: LocalFit) -> np.ndarray:
    """Ln of the prior's factor for every lognormal amplitude in w, 0 for all else (size,)."""
    hypothesis = local.hypothesis
    effects = (*hypothesis.problem.effects, *hypothesis.added)
    infos = [info for effect in effects for info in effect.parameters()]
    amplitudes = {label for info in infos if info.absent == 0.0 for label in info.labels}
    log_factors = np.zeros(len(local.w))
    for i, p in enumerate(hypothesis.parameters):
        if p.label in amplitudes and isinstance(p.prior, Lognormal):
            log_factors[i] = np.log(p.prior.factor)
    return log_factors


def promised(local: LocalFit) -> float:
    """Log-posterior that the top of a fit's model is above it."""
    model = model_of(local)
    none = np.zeros(len(local.w))
    return model.value(model.top(0.0, none)) - model.value(none)


def moved_within(model: Model, radius: float) -> tuple[np.ndarray, float]:
    """Step of w (size,) towards the top of a model, no entry above `radius`, and what it promises.

    Where the top is further, a change of w is made dear, the same in all directions, until the
    step is as long as it may be, but for ENOUGH_OF_IT: Levenberg 1944, Q. Appl. Math. 2; More
    1978, Lecture Notes in Mathematics 630; the units are prior sds. A step that fell much shorter
    would keep the next one from being longer.
    """
    none = np.zeros(len(model.w))
    d, damping = model.top(0.0, none), 0.0
    if model.length(d) > radius:
        d, damping = _damped(model, radius, d)
    return model.place(model.bent(d, damping)) - model.w, model.value(d) - model.value(none)


def _damped(model: Model, radius: float, d: np.ndarray) -> tuple[np.ndarray, float]:
    """Top with as little damping as brings it within a radius, and that damping.

    - `d` (size,): without any.
    """
    low, high = 0.0, FIRST_DAMPING
    d = model.top(high, d)
    while model.length(d) > radius:
        low, high = high, MORE_DAMPING * high
        d = model.top(high, d)
    while model.length(d) < ENOUGH_OF_IT * radius and high > LEAST_DAMPING:
        between = np.sqrt(low * high) if low > 0.0 else high / MORE_DAMPING**2
        shorter = model.top(between, d)
        if model.length(shorter) > radius:
            low = between
        else:
            high, d = between, shorter
        if low > 0.0 and high < 1.01 * low:
            break
    return d, high
