"""The simplest formula for an inferred curve, by the Bayesian information criterion."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

LEAST, CLOSE = 1e-3, 0.05
"""Probability of a misfit as large, below which a formula does not fit; the share of a curve that
it may leave all the same: a curve of straight pieces is no formula, however well it is known."""

FORMS: tuple[tuple[str, Callable[[np.ndarray], np.ndarray]], ...] = (
    ("a", lambda u: np.stack([np.ones_like(u)], axis=1)),
    ("a u", lambda u: np.stack([u], axis=1)),
    ("a + b u", lambda u: np.stack([np.ones_like(u), u], axis=1)),
    ("a sgn(u)", lambda u: np.stack([np.sign(u)], axis=1)),
    ("a sgn(u) + b u", lambda u: np.stack([np.sign(u), u], axis=1)),
    ("a u^2", lambda u: np.stack([u**2], axis=1)),
    ("a u |u|", lambda u: np.stack([u * np.abs(u)], axis=1)),
    ("a u + b u |u|", lambda u: np.stack([u, u * np.abs(u)], axis=1)),
    ("a u + b u^2", lambda u: np.stack([u, u**2], axis=1)),
    ("a u^3", lambda u: np.stack([u**3], axis=1)),
    ("a u + b u^3", lambda u: np.stack([u, u**3], axis=1)),
)


class Formula(NamedTuple):
    """A formula in u: its words with numbers put in, and its values (n,)."""

    words: str
    values: np.ndarray


def simplest(
    place: np.ndarray, mean: np.ndarray, covariance: np.ndarray, symbol: str
) -> Formula | None:
    """Choose among FORMS for amplitudes with a Gaussian law; None where the chosen does not fit.

    - `place`, `mean` (n,); `covariance` (n, n). - `symbol`: what u is called.
    """
    scale = max(float(np.abs(place).max()), 1e-300)
    u = place / scale
    ridge = 1e-9 * np.trace(covariance) / len(mean)
    precision = np.linalg.inv(covariance + ridge * np.eye(len(mean)))
    best: tuple[float, float, str, np.ndarray, np.ndarray] | None = None
    for words, form in FORMS:
        columns = form(u)
        normal = columns.T @ precision @ columns
        found, *_ = np.linalg.lstsq(normal, columns.T @ precision @ mean, rcond=None)
        left = mean - columns @ found
        misfit = float(left @ precision @ left)
        score = misfit + len(found) * np.log(len(mean))
        if best is None or score < best[0]:
            best = (score, misfit, words, found, columns @ found)
    assert best is not None  # FORMS is not empty
    _, misfit, words, numbers, values = best
    near = np.linalg.norm(mean - values) < CLOSE * np.linalg.norm(mean)
    if chi2.sf(misfit, len(mean) - len(numbers)) < LEAST and not near:
        return None
    return Formula(_worded(words, numbers, scale, symbol), values)


def _worded(words: str, numbers: np.ndarray, scale: float, symbol: str) -> str:
    """Put numbers in the place of a and b, for u in its own unit."""
    parts = []
    for part, number in zip(words.split(" + "), numbers, strict=True):
        rest = part[1:].strip()
        power = {"u": 1, "u^2": 2, "u |u|": 2, "u^3": 3}.get(rest, 0)
        parts.append(f"{number / scale**power:.3g} {rest}".strip().replace("u", symbol))
    return " + ".join(parts).replace("+ -", "- ")
