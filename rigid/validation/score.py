"""The likelihood's slope at the truth: what a campaign lets expect, before anything is fitted.

Over campaigns drawn from prior and likelihood the slope of the log-posterior at the truth has mean
zero and the information there as covariance, whatever the posterior's shape. So its length, in that
metric, tests the likelihood alone: no search, no law and no chain have a part in it. And one Newton
step from the truth leads to about where the posterior's centre must be: how far the truth is to lie
off it is known for every campaign, and what a study of few campaigns owes to their chance can be
told from what it owes to the fit.

Source: Rao (1948), Proceedings of the Cambridge Philosophical Society 44, for the test.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import chi2

from rigid.inference.newton import expanded, is_noise, joined
from rigid.likelihood.problem import Problem

SCORE = "score"
"""Name of the rank that a slope has."""


@dataclass(frozen=True)
class Score:
    """The slope of a log-posterior at a truth, gains and zeros of the sensors included.

    - `length`: its square, in the metric of the information there. - `size`: entries that it has.
    - `errors`: centre of the posterior less truth, in posterior sds, as the slope foretells it, by
      label; noise levels, which are held, have none.
    """

    length: float
    size: int
    errors: Mapping[str, float]

    @property
    def rank(self) -> float:
        """Probability of a shorter slope where the likelihood is right."""
        return float(chi2.cdf(self.length, self.size))


@dataclass(frozen=True)
class Slopes:
    """Slopes of all campaigns of a study.

    - `n`: campaigns. - `ratio`, `error`: squared length over the number of entries, 1 where the
      likelihood is right, and its standard error.
    """

    n: int
    ratio: float
    error: float

    @property
    def says(self) -> str:
        """What was found, in a sentence."""
        return (
            f"squared slopes at {self.n} truths are {self.ratio:.3f} ± {self.error:.3f} of what "
            "the likelihood says"
        )


def slopes(values: Sequence[Mapping[str, Any]]) -> Slopes | None:
    """Gather slopes from the values of rows; None for fewer than two that have one."""
    found = np.array([v["slope"]["length"] / v["slope"]["size"] for v in values if "slope" in v])
    if len(found) < 2:
        return None
    error = float(found.std(ddof=1) / np.sqrt(len(found)))
    return Slopes(len(found), float(found.mean()), error)


def score(problem: Problem, truth: np.ndarray, sensors: Mapping[str, tuple[float, float]]) -> Score:
    """Expand a log-posterior around the truth.

    - `truth` (size,): in z. - `sensors`: true gain and zero by sensor.
    """
    noise = is_noise(problem)
    at = joined(problem, truth, _standard(problem, sensors))
    found = expanded(problem, at, truth[noise])
    gradient = np.asarray(found.gradient)
    factor = cho_factor(np.asarray(found.information), lower=True)
    step = -cho_solve(factor, gradient)
    sds = np.sqrt(np.diag(cho_solve(factor, np.eye(len(gradient)))))
    labels = [
        p.label for p, held in zip(problem.parameters.sampled, noise, strict=True) if not held
    ]
    errors = dict(zip(labels, (step / sds)[: len(labels)].tolist(), strict=True))
    return Score(float(-gradient @ step), len(gradient), errors)


def _standard(problem: Problem, sensors: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """Gains and zeros of every sensor in units of their priors (sensors, 2)."""
    spreads = {p.sensor(i): p.sheet.spread for p in problem.pieces for i in range(len(p.tracks))}
    out = np.zeros((len(problem.sensors), 2))
    for row, label in zip(out, problem.sensors, strict=True):
        widths = spreads[label].gain, spreads[label].zero
        for i, (value, width) in enumerate(zip(sensors[label], widths, strict=True)):
            row[i] = value / width if width > 0.0 else 0.0
    return out
