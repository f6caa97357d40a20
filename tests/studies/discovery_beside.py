"""What a campaign of the benchmark tells beside discovery's answer: baselines, coverage, harm.

Baselines judge the same fit of the model as specified. Whiteness: Ljung and Box's test of each
channel's residuals and the correlation of every two channels of a record; something is missing
where the least p-value, times their number, is below 0.01; it has no names. BIC: the effect whose
squared strength, less its number of parameters times the log of the number of samples, is
greatest; nothing is missing where none is above 0. No record is left out for either.
"""

import itertools
from collections.abc import Mapping

import numpy as np
from discovery_cases import Made
from scipy.stats import chi2, norm

from rigid.discovery.outcome import Outcome
from rigid.localfit.local import LocalFit

LAGS = 20
DRAWS = 4000
RELEASE_HZ = 80.0
SAME = {
    "clock-offset": "pressure_delay",
    "constant-force": "F_constant",
    "effective-area": "area_excess",
    "valve-event": "event_size",
}
"""Effects whose number is the same in the generator and in the catalogue, and its label."""


def beside(outcome: Outcome, made: Made, seed: int) -> dict:
    """Give baselines, ranks of the truth before and after, and what was moved."""
    rng = np.random.default_rng([seed, 9])
    before, after = quoted(outcome.base, rng), quoted(outcome.final, rng)
    known = _known(made)
    return {
        "whiteness": whiteness(outcome.base),
        "bic": by_bic(outcome),
        "rank_before": ranks(before, known),
        "rank_after": ranks(after, known) | _added(outcome, made, rng),
        "moved": {
            k: float((np.median(after[k]) - np.median(v)) / np.std(v)) for k, v in before.items()
        },
    }


def whiteness(local: LocalFit) -> float:
    """Least p-value of the tests of all residuals, times their number; at most 1."""
    layout = local.layout
    series: dict[str, list[np.ndarray]] = {}
    found = []
    for number, channel in enumerate(layout.channels):
        rows = layout.channel == number
        scaled = np.where(layout.read[rows], local.residual[rows] / layout.floor[rows], 0.0)
        count = int(layout.read[rows].sum())
        if count < 5 * LAGS:
            continue
        scaled = scaled / np.sqrt(np.sum(scaled**2) / count)
        series.setdefault(channel.track, []).append(scaled)
        lagged = [np.sum(scaled[k:] * scaled[:-k]) / count for k in range(1, LAGS + 1)]
        weights = count * (count + 2.0) / (count - np.arange(1, LAGS + 1))
        found.append(float(chi2.sf(np.sum(weights * np.array(lagged) ** 2), LAGS)))
    for parts in series.values():
        for one, other in itertools.combinations(parts, 2):
            count = int(np.sum((one != 0.0) & (other != 0.0)))
            size = abs(np.sum(one * other)) / np.sqrt(max(count, 1))
            found.append(float(2.0 * norm.sf(size)))
    return min(1.0, min(found, default=1.0) * len(found))


def by_bic(outcome: Outcome) -> str | None:
    """The effect that the criterion takes first, or None."""
    found = outcome.steps[0].explained if outcome.steps else outcome.last
    samples = int(outcome.base.layout.read.sum())
    scores = {}
    for name in found.effects:
        best = max(
            (i for i, one in enumerate(found.listed) if one.effect.name == name),
            key=lambda i: abs(found.screening.strength[i]),
        )
        numbers = len(outcome.base.hypothesis.brought_by(found.listed[best].effect))
        gain = float(found.screening.strength[best]) ** 2
        scores[name] = gain - numbers * np.log(samples)
    top = max(scores, key=lambda name: scores[name], default=None)
    return top if top is not None and scores[top] > 0.0 else None


def quoted(local: LocalFit, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Draws (DRAWS,) of k_LC, every kappa and |mu| at 0 and 80 Hz, by the law around a fit."""
    values = drawn(local, rng)
    out = {k: v for k, v in values.items() if k == "k_LC" or k.startswith("kappa[")}
    return out | {
        f"|mu({hertz:g} Hz)|": np.abs(friction(values, hertz)) for hertz in (0.0, RELEASE_HZ)
    }


def drawn(local: LocalFit, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Draws of every number of a fit, SI, by label."""
    count = len(local.hypothesis.parameters)
    root = np.linalg.cholesky(local.covariance[:count, :count])
    z = local.w[:count] + rng.standard_normal((DRAWS, count)) @ root.T
    return {
        p.label: np.asarray(p.prior.from_standard(z[:, i]))
        for i, p in enumerate(local.hypothesis.parameters)
    }


def friction(values: Mapping, hertz: float):
    """mu(omega) of values by label: a dashpot and two branches with memory."""
    omega = 2.0j * np.pi * hertz
    branches = (
        values[f"mu_branch[{i}]"] / (1 + omega * values[f"tau_branch[{i}]"]) for i in (1, 2)
    )
    return values["mu"] + sum(branches)


def _known(made: Made) -> dict[str, float]:
    known = made.truth.parameters()
    return known | {f"|mu({h:g} Hz)|": float(abs(friction(known, h))) for h in (0.0, RELEASE_HZ)}


def ranks(values: Mapping[str, np.ndarray], known: Mapping[str, float]) -> dict[str, float]:
    """Probability below the truth, by label."""
    return {k: float(np.mean(v < known[k])) for k, v in values.items() if k in known}


def _added(outcome: Outcome, made: Made, rng: np.random.Generator) -> dict[str, float]:
    """Ranks of the truth among draws of what was rightly added, where it is the same number."""
    out = {}
    for cause in made.hidden:
        label = SAME.get(cause.name)
        if label is None or label not in outcome.final.hypothesis.labels:
            continue
        values = drawn(outcome.final, rng)[label]
        amplitude = float(cause.parameters()["amplitude"])
        # The generator's sign may be that of the other side: only the size is compared.
        out[f"{cause.name}: {label}"] = float(
            np.mean(values * np.sign(np.median(values)) < amplitude)
        )
    return out
