"""From a calibration to what the figures of its page show."""

import numpy as np

from rigid.inference.calibrate import Calibrated
from rigid.inference.derived import LEVELS, ChannelDraws, frictions, values_of
from rigid.inference.excitation import excited
from rigid.inference.friction_curve import FREQUENCIES
from rigid.likelihood.correlation import autocovariance
from rigid.physics.characteristic import PUBLISHED_RIG, TwoMassRig, dimensionless, roots
from rigid.physics.sensors import UNITS
from rigid.plots import metrology, shown
from rigid.report.paper_values import (
    FRICTION,
    of_the_paper,
    published,
    published_frictions,
)

NARROWER = 0.5
"""A stretch of mu(omega) counts as informed where the 90 % band of log |mu| is below this part of
the prior's."""

ROOT_DRAWS = 200

ROOT_STEPS = 3000

MOST_MU = 1.5e5
"""N s/m; epsilon = 2.15, as far as Fig. 4 goes."""

PRIOR_DRAWS = 4000

CORNER_DRAWS = 4000

RANK_BINS = 20

FIRST = ("k_LC", "mu", "F_C", "mu_branch", "tau_branch", "k_oil", "L_0")
"""Parameters that stand first in the corner figure."""

MOST_PAIRED = 9

LAGS = 40
"""Samples up to which autocorrelation is shown."""


def channel_fit(done: Calibrated, c: ChannelDraws) -> shown.ChannelFit:
    """One channel for the figures."""
    read = np.isfinite(c.data)
    record = next(r for r in done.records if (r.name, r.cylinder) == (c.record, c.cylinder))
    begins = [float(c.time[0]), *(s.until for s in record.valve[:-1])][: len(record.valve)]
    unit = UNITS[c.quantity]
    return shown.ChannelFit(
        record=c.record, cylinder=c.cylinder, kind=c.kind, quantity=c.quantity, unit=unit,
        time=c.time[read], data=c.data[read], quantiles=c.quantiles[:, read],
        residual=c.residual[read],
        valve=tuple((t, s.position) for t, s in zip(begins, record.valve, strict=True)),
        gap=c.gap, correlation_time=c.correlation_time,
        autocorrelation=np.stack([
            _autocorrelation(c.data - c.quantiles[2]),
            _autocorrelation(np.where(read, c.residual, np.nan)),
        ]),
    )  # fmt: skip


def _autocorrelation(series: np.ndarray) -> np.ndarray:
    """Autocorrelation at lags 1 to LAGS of a series with NaN where nothing was read."""
    known = np.isfinite(series)
    centred = np.where(known, series - np.mean(series[known]), 0.0)
    found = autocovariance(centred, known, LAGS)
    return found[1:] / found[0] if found[0] > 0.0 else np.zeros(LAGS)


def friction_curve(done: Calibrated) -> shown.FrictionCurve | None:
    """mu(omega) with its bands beside the prior's; None where no record is of the rig."""
    if not done.frictions:
        return None
    curve = next(iter(done.frictions.values()))
    rng = np.random.default_rng([done.seed, 4])
    prior_z = rng.standard_normal((PRIOR_DRAWS, done.problem.parameters.size))
    prior = next(iter(frictions(done.problem, values_of(done.problem, prior_z)).values()))
    quantiles = {
        name: np.percentile(series, LEVELS, axis=0)
        for name, series in (
            ("dissipative", curve.dissipative),
            ("storage", curve.storage),
            ("magnitude", curve.magnitude),
            ("prior_magnitude", prior.magnitude),
        )
    }
    informed = narrowed(quantiles["magnitude"], quantiles["prior_magnitude"])
    ours = of_the_paper(done.problem)
    printed = tuple((f, p.value, p.place) for f, p in published_frictions(ours))
    return shown.FrictionCurve(
        frequency=FREQUENCIES, **quantiles, informed=informed,
        excited=excited(done.shown),
        published=printed,
    )  # fmt: skip


def narrowed(after: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Where records and not the prior alone speak of |mu| (m,).

    - `after`, `before` (5, m): quantiles of |mu| [N s/m] at LEVELS, of posterior and prior.
    """
    tiny = 1e-300
    widths = [np.log((each[4] + tiny) / (each[0] + tiny)) for each in (after, before)]
    return widths[0] < NARROWER * widths[1]


def corner(done: Calibrated) -> shown.ParameterDraws | None:
    """Draws of the machine's own parameters for the corner figure; None where there are none."""
    rig = done.problem.of_the_rig
    local = ("kappa", "kappa_tank", "noise", "preload", "release_time", "M_Pl", "k_frame")
    left_out = local if rig else ("noise",)
    machine = [p for p in done.problem.parameters.sampled if p.base not in left_out]
    # Sorted is stable: what matters first, the rest in the order of the model.
    chosen = sorted(machine, key=lambda p: FIRST.index(p.base) if p.base in FIRST else len(FIRST))
    chosen = chosen[:MOST_PAIRED]
    if not chosen:
        return None
    flat = np.stack([done.values[p.label].ravel() for p in chosen])
    every = max(1, flat.shape[1] // CORNER_DRAWS)
    ours = of_the_paper(done.problem)
    printed = [published(p.base, ours) for p in chosen]
    marks = tuple(values[0].value if values else None for values in printed)
    symbols = tuple(p.numbered_symbol for p in chosen)
    return shown.ParameterDraws(symbols, tuple(p.unit for p in chosen), flat[:, ::every], marks)


def traces(done: Calibrated) -> tuple[shown.Trace, ...]:
    """Ensemble means over steps and rank histograms of a few parameters."""
    out, z = [], done.draws.z
    ensembles, steps = z.shape[:2]
    chosen = [
        i
        for i, p in enumerate(done.problem.parameters.sampled)
        if not done.problem.of_the_rig
        or p.base in ("k_LC", "mu", "k_oil", "mu_branch", "tau_branch")
    ][:6]
    for i in chosen:
        p = done.problem.parameters.sampled[i]
        means = np.asarray(p.prior.from_standard(z[..., i])).mean(axis=2)
        rank = z[..., i].ravel().argsort().argsort().reshape(ensembles, -1)
        edges = np.linspace(0, rank.size, RANK_BINS + 1)
        ranks = np.stack([np.histogram(r, edges)[0] for r in rank])
        warmup, symbol = done.draws.warmup, p.numbered_symbol
        out.append(shown.Trace(symbol, p.unit, warmup + np.arange(steps), means, warmup, ranks))
    return tuple(out)


def roots_shown(done: Calibrated) -> shown.Roots | None:
    """Roots of eq. (14) as Fig. 4 has them, with those of the posterior at the release's mu.

    None where no record is of the paper's rig.
    """
    if not done.frictions or not of_the_paper(done.problem):
        return None
    paths = np.stack(
        [_roots(PUBLISHED_RIG, float(mu)) for mu in np.linspace(0.0, MOST_MU, ROOT_STEPS)], 1
    )
    at = int(np.argmin(np.abs(FREQUENCIES - 80.0)))
    mu = list(done.frictions.values())[-1].dissipative[:, at]
    every = max(1, len(mu) // ROOT_DRAWS)
    listed = (*done.problem.parameters.sampled, *done.problem.parameters.known)
    v = {p.base: done.values[p.label].ravel()[::every] for p in listed}
    rigs = [
        TwoMassRig(
            float(v["M_HC"][i] - v["M_Pl"][i]),
            float(v["M_Pl"][i] + v["M_Fl"][i] / 2),
            float(v["k_oil"][i] * v["S_Pl"][i] / v["L_0"][i]),
            float(v["k_LC"][i]),
        )
        for i in range(len(v["k_LC"]))
    ]
    cloud = [_roots(rig, float(m)) for rig, m in zip(rigs, mu[::every], strict=True)]
    marks = tuple(
        (f"{metrology.exact(p.value, 'N s/m')}, {p.place}", _roots(PUBLISHED_RIG, p.value))
        for _, p in FRICTION
    )
    return shown.Roots(
        paths,
        (0.0, float(dimensionless(PUBLISHED_RIG, MOST_MU).epsilon)),
        _roots(PUBLISHED_RIG, 0.0),
        marks,
        ("posterior, Re μ at 80 Hz", np.concatenate(cloud)),
    )


def _roots(rig: TwoMassRig, mu: float) -> np.ndarray:
    scaled = dimensionless(rig, mu)
    return roots(scaled.epsilon, scaled.a1, scaled.a2)
