"""Have the ensembles forgotten where they began, and how many independent draws are there.

Values come as (ensembles, steps, walkers). R-hat is judged between ensembles, because the walkers
of one ensemble steer each other; the effective sample size counts every walker as a chain, because
flattened walkers look independent and give a figure thirty to a hundred times too high.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import chi2, rankdata

with warnings.catch_warnings():
    # ArviZ 0.23 announces its successor on import, to those who did not import it themselves.
    warnings.filterwarnings("ignore", r"\s*ArviZ is undergoing", FutureWarning)
    import arviz as az

TAILS = (0.05, 0.95)
# Odds of a false alarm of the check against the spread of ensemble means, over all quantities.
FALSE_ALARM = 1e-3
# Least draws of a mode, per ensemble, for an R-hat within it: two halves of 50, whose own noise is
# some 1/50 in the ratio of variances.
LEAST_IN_MODE = 100


@dataclass(frozen=True)
class Diagnosis:
    """How far one quantity has converged; None where the figure has no meaning (a constant).

    - spread: probability that ensemble means lie as far apart as they do, if the ESS were right
    """

    name: str
    r_hat: float | None
    ess_bulk: float | None
    ess_tail: float | None
    spread: float | None


def diagnose(
    name: str, values: NDArray[np.float64], modes: NDArray[np.intp] | None = None
) -> Diagnosis:
    """Judge one quantity.

    - values: (ensembles, steps, walkers)
    - modes: same shape, the mode each draw is in; then R-hat is the worst of that between
      ensembles and those within each mode
    """
    if not np.all(np.isfinite(values)):
        return Diagnosis(name, float("inf"), 0.0, 0.0, None)
    if np.ptp(values) == 0.0:
        return Diagnosis(name, None, None, None, None)
    bulk, tail = effective_sizes(values)
    return Diagnosis(name, r_hat(values, modes), bulk, tail, spread(values, bulk))


def r_hat(values: NDArray[np.float64], modes: NDArray[np.intp] | None = None) -> float:
    """Rank-normalised split R-hat between ensembles, and within modes if they are given.

    Draws are laid out step by step, so that the halves are early and late.

    Source: Vehtari et al. (2021), "Rank-normalization, folding, and localization".
    """
    flat = values.reshape(len(values), -1)
    figures = [_r_hat(flat)]
    if modes is not None:
        labels = modes.reshape(len(values), -1)
        figures += [_r_hat(part) for part in _by_mode(flat, labels)]
    return max(figures)


def _r_hat(chains: NDArray[np.float64]) -> float:
    with np.errstate(all="ignore"):  # ensembles that stand still, each elsewhere: infinite
        figure = float(np.asarray(az.rhat(chains)))
    return figure if np.isfinite(figure) else float("inf")


def _by_mode(flat: NDArray[np.float64], labels: NDArray[np.intp]) -> list[NDArray[np.float64]]:
    """Draws of each mode, (ensembles, n), with n the least any ensemble has; too few: left out."""
    parts = []
    for mode in np.unique(labels) if labels.min() < labels.max() else []:
        inside = [chain[label == mode] for chain, label in zip(flat, labels, strict=True)]
        n = min(map(len, inside))
        if n >= LEAST_IN_MODE and np.ptp(np.concatenate(inside)) > 0.0:
            even = [chain[np.linspace(0, len(chain) - 1, n).astype(int)] for chain in inside]
            parts.append(np.stack(even))
    return parts


def effective_sizes(values: NDArray[np.float64]) -> tuple[float, float]:
    """Bulk and tail ESS of (ensembles, steps, walkers), with every walker a chain."""
    chains = values.transpose(0, 2, 1).reshape(-1, values.shape[1])
    bulk = az.ess(chains, method="bulk")
    tail = az.ess(chains, method="tail", prob=TAILS)
    return float(np.asarray(bulk)), float(np.asarray(tail))


def spread(values: NDArray[np.float64], ess: float) -> float:
    """Probability of ensemble means as far apart as these, were there `ess` independent draws.

    The means of `ensembles` groups of ess/ensembles draws each scatter with variance
    variance * ensembles / ess, so the sum of their squares over that is chi-squared. On normal
    scores, the scale on which the bulk ESS is measured.
    """
    ensembles = len(values)
    if ensembles < 2:
        return 1.0
    ranks = rankdata(values, axis=None).reshape(ensembles, -1)
    scores = ndtri((ranks - 0.375) / (ranks.size + 0.25))
    means = scores.mean(axis=1)
    expected = scores.var() * ensembles / ess
    return float(chi2.sf(np.sum((means - means.mean()) ** 2) / expected, ensembles - 1))


def lacking(found: Sequence[Diagnosis], r_hat_limit: float, ess: float) -> list[str]:
    """What is not good enough yet, worst quantity first, a clause for each rule broken."""
    says = []
    worst = worst_r_hat(found)
    if worst is not None and worst.r_hat is not None and not worst.r_hat < r_hat_limit:
        says.append(f"R-hat of {worst.name} is {worst.r_hat:.3f}, must be below {r_hat_limit:g}")
    rules = (("bulk", "ess_bulk", ess), ("tail", "ess_tail", ess / 2))
    for word, field, wanted in rules:
        least = least_ess(found, field)
        if least is not None and not getattr(least, field) >= wanted:
            size = getattr(least, field)
            says.append(f"{word} ESS of {least.name} is {size:.0f}, must reach {wanted:.0f}")
    apart = [d for d in found if d.spread is not None and d.spread < FALSE_ALARM / len(found)]
    if apart:
        least = min(apart, key=lambda d: d.spread or 0.0)
        says.append(
            f"the ensembles' means of {least.name} lie further apart than its ESS allows "
            f"(odds {least.spread:.0e})"
        )
    return says


def least_ess(found: Sequence[Diagnosis], field: str = "ess_bulk") -> Diagnosis | None:
    """The quantity with the smallest ESS of the given field; None if all are constant."""
    known = [d for d in found if getattr(d, field) is not None]
    return min(known, key=lambda d: getattr(d, field), default=None)


def worst_r_hat(found: Sequence[Diagnosis]) -> Diagnosis | None:
    """The quantity with the largest R-hat; None if all are constant."""
    known = [d for d in found if d.r_hat is not None]
    return max(known, key=lambda d: d.r_hat or 0.0, default=None)
