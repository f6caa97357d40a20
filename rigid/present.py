"""From a calibration to what its page shows; all numbers are worked out here or before."""

import datetime
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np

from rigid import __version__
from rigid.calibrate import Calibrated
from rigid.characteristic import PUBLISHED_RIG, TwoMassRig, dimensionless, roots
from rigid.friction import FREQUENCIES
from rigid.outcome import LEVELS, Channel, frictions, values_of
from rigid.parameters import Parameter
from rigid.published import BY_LABEL, FRICTION, KAPPA
from rigid.report import content as page
from rigid.results import friction_at, versions
from rigid.spec import Spec
from rigid.summary import Result

EXCITED = (("steady running", 0.01, 0.05), ("quick release", 60.0, 260.0))
"""Hz; where the records move the rig: at rest or steadily, and at its own frequencies."""

NARROWER = 0.7
"""A stretch of mu(omega) counts as informed where the 90 % band of log |mu| is below this part of
the prior's."""

ROOT_DRAWS = 200
MOST_MU = 1.5e5
"""N s/m; epsilon = 2.15, as far as Fig. 4 goes."""
PRIOR_DRAWS = 4000
CORNER_DRAWS = 4000
RANK_BINS = 20


def content(spec: Spec, done: Calibrated, found: Result) -> page.CalibrationContent:
    """Gather all that the section on a calibration shows."""
    from rigid.alternatives import alternatives

    return page.CalibrationContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        usable=found.usable,
        checks=tuple(page.Check(c.name, c.ok, c.says) for c in found.checks),
        key_numbers=key_numbers(done),
        parameters=parameter_rows(done, found),
        fits=tuple(channel_fit(done, c) for c in done.shown),
        records=record_notes(done),
        provenance=provenance(spec, done, found),
        summary=summary(done),
        gap=found.gap.overall,
        products=products(done),
        alternatives=alternatives(spec, done),
        modes=mode_rows(done),
        friction=friction_curve(done),
        draws=corner(done),
        traces=traces(done),
        roots=roots_shown(done),
    )


def _figures(values: np.ndarray) -> dict[str, float]:
    """Median, sd and the 5 % and 95 % quantiles of draws."""
    low, middle, high = (float(q) for q in np.percentile(values, [5, 50, 95]))
    return {"median": middle, "sd": float(np.std(values)), "q05": low, "q95": high}


def _published(label: str) -> tuple[page.Published, ...]:
    return tuple(page.Published(p.value, p.place) for p in BY_LABEL.get(label, ()))


def key_numbers(done: Calibrated) -> tuple[page.KeyNumber, ...]:
    """The few numbers people come for."""
    out = []
    for p in done.problem.parameters.sampled:
        if p.base == "k_LC":
            out.append(page.KeyNumber(
                "stiffness of the load-cell end", "k_{LC}", p.unit,
                **_figures(done.values[p.label]), published=_published("k_LC"),
            ))  # fmt: skip
    printed = {0.01: FRICTION[1:], 80.0: FRICTION[:1]}
    for (label, values), at in zip(friction_at(done).items(), _cycled(done), strict=True):
        name = "friction in steady running" if at < 1.0 else "friction at 80 Hz"
        view = label[7:-1].partition(",")[2]
        out.append(page.KeyNumber(
            f"{name} ({view})" if view else name,
            r"\mu(0)" if at < 1.0 else r"|\mu(80\,\mathrm{Hz})|", "N s/m", **_figures(values),
            published=tuple(page.Published(p.value, p.place) for _, p in printed[at]),
        ))  # fmt: skip
    for p in done.problem.parameters.sampled:
        if p.base == "kappa":
            out.append(page.KeyNumber(
                f"flow fraction, {p.label[6:-1]}", r"\kappa", "-", **_figures(done.values[p.label]),
                published=tuple(page.Published(k.value, k.place) for k in KAPPA),
                reading="a valve setting of its own in every record; the paper's are of its field test",
            ))  # fmt: skip
    return tuple(out)


def _cycled(done: Calibrated) -> list[float]:
    """Frequencies in the order of `friction_at`."""
    return [f for _ in done.frictions for f in (0.01, 80.0)]


def parameter_rows(done: Calibrated, found: Result) -> tuple[page.ParameterRow, ...]:
    """Prior beside posterior for every sampled parameter."""
    figures = {row.name: row.summary for row in found.parameters}
    z = done.draws.z.reshape(-1, done.draws.z.shape[-1])
    out = []
    for i, p in enumerate(done.problem.parameters.sampled):
        s = figures[p.label]
        low, middle, high = sorted(
            float(v) for v in p.law.from_standard(np.array([-1.6449, 0.0, 1.6449]))
        )
        out.append(page.ParameterRow(
            name=p.label, symbol=p.symbol, unit=_unit(p), prior_median=middle, prior_q05=low,
            prior_q95=high, median=s.median, mean=s.mean, sd=s.sd, q05=s.q05, q95=s.q95,
            ess_bulk=s.ess_bulk, ess_tail=s.ess_tail, r_hat=s.r_hat,
            informed=float(np.clip(1.0 - z[:, i].std(), 0.0, 1.0)), published=_published(p.label),
        ))  # fmt: skip
    return tuple(out)


def _unit(p: Parameter) -> str:
    return "-" if p.unit == "1" else p.unit


def channel_fit(done: Calibrated, c: Channel) -> page.ChannelFit:
    """One channel for the figures."""
    read = np.isfinite(c.data)
    record = next(r for r in done.records if (r.name, r.cylinder) == (c.record, c.cylinder))
    begins = [float(c.time[0]), *(s.until for s in record.valve[:-1])]
    unit = {"load": "N", "stroke": "m", "pressure": "Pa", "acceleration": "m/s^2"}[c.quantity]
    return page.ChannelFit(
        record=c.record, cylinder=c.cylinder, kind=c.kind, quantity=c.quantity, unit=unit,
        time=c.time[read], data=c.data[read], quantiles=c.quantiles[:, read],
        residual=c.residual[read],
        valve=tuple((t, s.position) for t, s in zip(begins, record.valve, strict=True)),
        gap=c.gap, correlation_time=c.correlation_time,
    )  # fmt: skip


def record_notes(done: Calibrated) -> tuple[page.RecordNote, ...]:
    """The records as they were read."""
    return tuple(
        page.RecordNote(
            r.name, r.cylinder, r.kind, r.path.name, len(r.time),
            float(r.time[-1] - r.time[0]), r.notes,
        )
        for r in done.records
    )  # fmt: skip


def products(done: Calibrated) -> tuple[page.ProductRow, ...]:
    """Combinations that the records identify better than their parts."""
    ratio = done.values["k_oil"] / done.values["L_0"]
    out = [page.ProductRow(
        "k_oil / L_0", r"k_\mathrm{oil}/L_0", "Pa/m", **_figures(ratio),
        why="only k_oil/(L_0 + x) enters (eq. 21): the parts keep much of their priors",
    )]  # fmt: skip
    litre_per_minute = 11.61
    for p in done.problem.parameters.sampled:
        if p.base == "kappa":
            out.append(page.ProductRow(
                f"kappa q, {p.label[6:-1]}", r"\kappa q", "l/min",
                **_figures(done.values[p.label] * litre_per_minute),
                why="only the product of flow fraction and pump curve enters; q is that of eq. (22)",
            ))  # fmt: skip
    return tuple(out)


def mode_rows(done: Calibrated) -> tuple[page.ModeRow, ...]:
    """Modes of the posterior with their weights."""
    z = np.stack([o.z for o in done.found.optima])
    values = values_of(done.problem, z)
    shown = [p for p in done.problem.parameters.sampled if p.base in ("k_LC", "mu")]
    return tuple(
        page.ModeRow(
            float(done.weights.weights[i]), float(done.weights.error[i]),
            tuple((p.symbol, p.unit, float(values[p.label][i])) for p in shown),
            f"reached by {o.reached} of {done.found.starts} starts",
        )
        for i, o in enumerate(done.found.optima)
    )  # fmt: skip


def friction_curve(done: Calibrated) -> page.FrictionCurve:
    """mu(omega) with its bands beside the prior's."""
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
    tiny = 1e-300
    width = np.log((quantiles["magnitude"][4] + tiny) / (quantiles["magnitude"][0] + tiny))
    before = quantiles["prior_magnitude"]
    informed = width < NARROWER * np.log((before[4] + tiny) / (before[0] + tiny))
    published = tuple((f, p.value, p.place) for f, p in FRICTION)
    return page.FrictionCurve(
        frequency=FREQUENCIES, **quantiles, informed=informed, excited=EXCITED,
        published=published,
    )  # fmt: skip


def corner(done: Calibrated) -> page.Draws:
    """Draws of the rig's own parameters for the corner figure."""
    local = ("kappa", "kappa_tank", "noise", "preload", "release_time", "M_Pl", "k_frame")
    shown = [p for p in done.problem.parameters.sampled if p.base not in local][:9]
    flat = np.stack([done.values[p.label].ravel() for p in shown])
    every = max(1, flat.shape[1] // CORNER_DRAWS)
    marks = tuple(BY_LABEL[p.base][0].value if p.base in BY_LABEL else None for p in shown)
    symbols = tuple(p.symbol if not p.label.endswith("]") else
                    p.symbol.replace("_i", "_" + p.label[-2]) for p in shown)
    return page.Draws(symbols, tuple(p.unit for p in shown), flat[:, ::every], marks)


def traces(done: Calibrated) -> tuple[page.Trace, ...]:
    """Ensemble means over steps and rank histograms of a few parameters."""
    out, z = [], done.draws.z
    ensembles, steps = z.shape[:2]
    chosen = [i for i, p in enumerate(done.problem.parameters.sampled)
              if p.base in ("k_LC", "mu", "k_oil", "mu_branch", "tau_branch")][:6]
    for i in chosen:
        p = done.problem.parameters.sampled[i]
        means = np.asarray(p.law.from_standard(z[..., i])).mean(axis=2)
        rank = z[..., i].ravel().argsort().argsort().reshape(ensembles, -1)
        edges = np.linspace(0, rank.size, RANK_BINS + 1)
        ranks = np.stack([np.histogram(r, edges)[0] for r in rank])
        symbol = p.symbol.replace("_i", "_" + p.label[-2]) if p.label.endswith("]") else p.symbol
        out.append(page.Trace(
            symbol, p.unit, done.draws.warmup + np.arange(steps), means, done.draws.warmup, ranks
        ))  # fmt: skip
    return tuple(out)


def roots_shown(done: Calibrated) -> page.Roots:
    """Roots of eq. (14) as Fig. 4 has them, with those of the posterior at the release's mu."""
    paths = np.stack([_roots(PUBLISHED_RIG, float(mu)) for mu in np.linspace(0.0, MOST_MU, 600)], 1)
    at = int(np.argmin(np.abs(FREQUENCIES - 80.0)))
    mu = list(done.frictions.values())[-1].dissipative[:, at]
    every = max(1, len(mu) // ROOT_DRAWS)
    v = {label.split("[")[0]: s.ravel()[::every] for label, s in done.values.items()}
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
    marks = tuple((f"{p.value:.3g} N s/m", _roots(PUBLISHED_RIG, p.value)) for _, p in FRICTION)
    return page.Roots(
        paths,
        (0.0, float(dimensionless(PUBLISHED_RIG, MOST_MU).epsilon)),
        _roots(PUBLISHED_RIG, 0.0),
        marks,
        ("posterior, Re mu at 80 Hz", np.concatenate(cloud)),
    )


def _roots(rig: TwoMassRig, mu: float) -> np.ndarray:
    scaled = dimensionless(rig, mu)
    return roots(scaled.epsilon, scaled.a1, scaled.a2)


def summary(done: Calibrated) -> str:
    """One or two sentences below the verdict."""
    p = done.problem.parameters
    told = f"{p.size} parameters from {len(done.records)} records"
    modes = len(done.found.optima)
    return f"{told}; the posterior has {modes} mode{'s' if modes > 1 else ''}."


def provenance(spec: Spec, done: Calibrated, found: Result) -> page.Provenance:
    """Enough to make the page again."""
    cost = found.cost.values()
    return page.Provenance(
        version=__version__,
        commit=_commit(),
        command="python -m rigid.fit " + " ".join(sys.argv[1:]),
        date=datetime.datetime.now(datetime.UTC).date().isoformat(),
        seed=done.seed,
        spec_name=spec.path.stem,
        spec_text=spec.text,
        sha256=tuple((r.path.name, r.sha256) for r in done.records),
        versions=tuple(versions().items()),
        wall_s=float(cost["wall_s"]),
        compile_s=float(cost["compile_s"]),
        evaluations=int(cost["evaluations"]),
        failed_solves=int(cost["failed_solves"]),
        evaluations_per_s=cost["evaluations_per_s"],
        ess_min=cost["ess_min"],
        ess_min_per_s=cost["ess_min_per_s"],
        machine=f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}",
    )


def _commit() -> str | None:
    """Commit of the checkout the package runs from, None outside one."""
    folder = Path(__file__).resolve().parent.parent
    if not (folder / ".git").exists():
        return None
    asked = subprocess.run(
        ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return asked.stdout.strip() or None
