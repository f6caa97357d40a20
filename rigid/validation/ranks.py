"""Where a truth lies among draws: posterior probability below it, for all that a fit quotes.

Under a sound posterior each is uniform from campaign to campaign, whatever the model. So is that of
the weight that the law over the modes gives: where a law, and what began in it, miss the places
where truths lie, these weigh more than nearly all draws.
Sources: Talts et al. (2018), simulation-based calibration; Modrak et al. (2023), Bayesian Analysis,
for the log-posterior and other quantities that hang on the data; Lemos et al. (2023), ICML, TARP.
"""

from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import norm

from rigid.inference.coordinates import chart_of
from rigid.inference.derived import frictions, values_of
from rigid.inference.friction_curve import FREQUENCIES
from rigid.inference.search_cache import Searched
from rigid.likelihood.problem import Problem
from rigid.validation.draws import Weighted, evaluated

HERTZ = (0.1, 1.0, 10.0, 100.0)
"""Frequencies at which both parts of mu(omega) are ranked."""
ENDS = (0.01, 80.0)
"""Frequencies whose |mu| a fit quotes."""
LOG_POSTERIOR, TARP, WEIGHT = "log-posterior", "TARP", "weight"
"""What is ranked of the posterior as a whole."""


def ranks(
    known: Searched,
    draws: Weighted,
    truth: np.ndarray,
    sensors: Mapping[str, tuple[float, float]],
    rng: np.random.Generator,
) -> dict[str, float]:
    """Posterior probability below the truth, by quantity.

    - `known`: the fit whose draws these are. - `truth` (size,): in z. - `sensors`: true gain and
      zero by sensor. - `rng`: places TARP's point of reference.
    """
    problem = known.found.problem
    out = {
        label: _below(draws.z[:, i], draws.weight, truth[i])
        for i, label in enumerate(problem.parameters.labels)
    }
    out |= _frictions(problem, draws, truth)
    for label, (gain, zero) in sensors.items():
        if label in draws.sensors:
            law = draws.sensors[label]
            for name, true, mean, variance in (
                ("gain", gain, law[0], law[2]),
                ("zero", zero, law[1], law[4]),
            ):
                if np.all(variance > 0.0):
                    below = norm.cdf((true - mean) / np.sqrt(variance))
                    out[f"{name}[{label}]"] = _mean(below, draws.weight)
    there = evaluated(problem, truth[None])[0][0]
    out[LOG_POSTERIOR] = _below(draws.log_posterior, draws.weight, there)
    out[TARP] = tarp(problem, draws, truth, rng)

    def weights(z: np.ndarray, log_posterior: np.ndarray | float) -> np.ndarray:
        return log_posterior - known.law.log_density(known.chart.straight(z))

    own = float(weights(truth[None], there)[0])
    out[WEIGHT] = _below(weights(draws.z, draws.log_posterior), draws.weight, own)
    return out


def _mean(values: np.ndarray, weight: np.ndarray) -> float:
    return float(values @ weight / weight.sum())


def _below(values: np.ndarray, weight: np.ndarray, truth: float) -> float:
    return _mean(values < truth, weight)


def _frictions(problem: Problem, draws: Weighted, truth: np.ndarray) -> dict[str, float]:
    """Ranks of friction at some frequencies, for every view of the rig that has its own."""
    every = np.concatenate([draws.z, truth[None]])
    out = {}
    for label, curve in frictions(problem, values_of(problem, every)).items():
        place = f",{label}" if label else ""
        series = {f"|mu|[{hertz:g} Hz{place}]": (curve.magnitude, hertz) for hertz in ENDS}
        for hertz in HERTZ:
            series[f"mu_omega[{hertz:g} Hz{place}]"] = curve.dissipative, hertz
            series[f"k_omega[{hertz:g} Hz{place}]"] = curve.storage, hertz
        for name, (values, hertz) in series.items():
            column = values[:, int(np.argmin(abs(FREQUENCIES - hertz)))]
            if np.ptp(column) > 0.0:  # friction without memory stores nothing
                out[name] = _below(column[:-1], draws.weight, column[-1])
    return out


def tarp(problem: Problem, draws: Weighted, truth: np.ndarray, rng: np.random.Generator) -> float:
    """Share of draws that are closer to a point of reference than the truth is.

    Distances are in the posterior's own standard deviations, and the point is drawn of the Gaussian
    law with its mean and covariance: both follow from the campaign, not from its truth.
    """
    chart = chart_of(problem)
    u, true = chart.straight(draws.z), chart.straight(truth)
    weight = draws.weight / draws.weight.sum()
    centre = weight @ u
    away = u - centre
    covariance = (away * weight[:, None]).T @ away
    factor = np.linalg.cholesky(covariance + 1e-12 * np.eye(len(centre)))
    point = rng.standard_normal(len(centre))

    def distance(rows: np.ndarray) -> np.ndarray:
        own = solve_triangular(factor, (rows - centre).T, lower=True).T
        return np.sum((own - point) ** 2, axis=1)

    return _below(distance(u), draws.weight, float(distance(true[None])[0]))
