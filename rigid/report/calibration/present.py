"""From a calibration to what its page shows; all numbers are worked out here or before."""

import datetime
import os
import platform
import sys
from collections.abc import Mapping, Sequence

import numpy as np

from rigid import __version__
from rigid.inference.alternatives import alternatives
from rigid.inference.calibrate import Calibrated
from rigid.inference.derived import values_of
from rigid.inference.summary import Result
from rigid.io.provenance import commit, versions
from rigid.likelihood.parameters import Parameter
from rigid.report import content as page
from rigid.report.calibration.output import friction_at
from rigid.report.calibration.shown import channel_fit, corner, friction_curve, roots_shown, traces
from rigid.report.paper_values import FRICTION, KAPPA, Published, published
from rigid.spec import Spec

FAST_FLOW = 6.645 + 4.965  # l/min; eq. (22) far below p_max
PAPER_KAPPA = " and ".join(f"{k.value:g} ({k.place.split(', ', 2)[2]})" for k in KAPPA)


def content(spec: Spec, done: Calibrated, found: Result) -> page.CalibrationContent:
    """Gather all that the section on a calibration shows."""
    return page.CalibrationContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        usable=found.usable,
        checks=tuple(page.Check(c.name, c.ok, c.says) for c in found.checks),
        key_numbers=key_numbers(spec, done),
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


def _quantiles(values: np.ndarray) -> tuple[float, float, float]:
    low, middle, high = (float(q) for q in np.percentile(values, [5, 50, 95]))
    return low, middle, high


def _key(
    label: str,
    symbol: str,
    unit: str,
    values: np.ndarray,
    published: tuple[page.Published, ...] = (),
    reading: str = "",
) -> page.KeyNumber:
    """One of the key numbers, from its draws."""
    low, middle, high = _quantiles(values)
    sd = float(np.std(values))
    return page.KeyNumber(label, symbol, unit, middle, sd, low, high, published, reading)


def _published(done: Calibrated, label: str) -> tuple[page.Published, ...]:
    printed = published(label, done.problem.of_the_rig)
    return tuple(page.Published(p.value, p.place) for p in printed)


def key_numbers(spec: Spec, done: Calibrated) -> tuple[page.KeyNumber, ...]:
    """The few numbers people come for; of another machine all that are no noise."""
    if done.problem.of_the_rig:
        return _of_the_rig(done)
    return tuple(
        _key(_worded(spec, p), p.symbol, _unit(p), done.values[p.label])
        for p in done.problem.parameters.sampled
        if p.base != "noise"
    )


def _worded(spec: Spec, p: Parameter) -> str:
    """What a parameter of another machine is called."""
    names = {"M_Pl": f"mass of the {spec.model.body}", "S_Pl": "area that the pressure acts on"}
    return names.get(p.base, p.label)


def _of_the_rig(done: Calibrated) -> tuple[page.KeyNumber, ...]:
    """Stiffness, friction and flow fractions."""
    sampled, stiffness = done.problem.parameters.sampled, "stiffness of the load-cell end"
    out = [
        _key(stiffness, "k_{LC}", p.unit, done.values[p.label], _published(done, "k_LC"))
        for p in sampled
        if p.base == "k_LC"
    ]
    out += frictions(friction_at(done))
    reading = f"a valve setting of this record's own; the paper gives {PAPER_KAPPA}"
    out += [
        _key(f"flow fraction, {p.label[6:-1]}", r"\kappa", "-", done.values[p.label], (), reading)
        for p in sampled
        if p.base == "kappa"
    ]
    return tuple(out)


def frictions(found: Mapping[str, np.ndarray]) -> list[page.KeyNumber]:
    """Friction at both ends of what is on record; once where it is the same at all frequencies.

    - `found`: draws of |mu| [N s/m] by label, of every view the slow one first, as `friction_at`
      gives them.
    """
    listed, out = iter(found.items()), []
    for (label, slow), (_, fast) in zip(listed, listed, strict=True):
        view = label[7:-1].partition(",")[2]
        said = f" ({view})" if view else ""
        if np.allclose(slow, fast, rtol=1e-9, atol=0.0):
            out.append(_friction(f"friction, whatever the frequency{said}", r"\mu", slow, FRICTION))
            continue
        steady, rapid = f"friction in steady running{said}", f"friction at 80 Hz{said}"
        out.append(_friction(steady, r"\mu(0)", slow, FRICTION[1:]))
        out.append(_friction(rapid, r"|\mu(80\,\mathrm{Hz})|", fast, FRICTION[:1]))
    return out


def _friction(
    name: str, symbol: str, values: np.ndarray, printed: Sequence[tuple[float | None, Published]]
) -> page.KeyNumber:
    """One coefficient of friction beside the printed ones of its frequency."""
    known = tuple(page.Published(p.value, p.place) for _, p in printed)
    return _key(name, symbol, "N s/m", values, known)


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
            informed=float(np.clip(1.0 - z[:, i].std(), 0.0, 1.0)),
            published=_published(done, p.label),
        ))  # fmt: skip
    return tuple(out)


def _unit(p: Parameter) -> str:
    return "-" if p.unit == "1" else p.unit


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
    if not done.problem.of_the_rig:
        return ()
    ratio = done.values["k_oil"] / done.values["L_0"]
    why = "only k_oil/(L_0 + x) enters (eq. 21): the parts keep much of their priors"
    out = [_product("k_oil / L_0", r"k_\mathrm{oil}/L_0", "Pa/m", ratio, why)]
    why = "only flow fraction times pump curve enters; q is that of eq. (22)"
    for p in done.problem.parameters.sampled:
        if p.base == "kappa":
            flow = done.values[p.label] * FAST_FLOW
            out.append(_product(f"kappa q, {p.label[6:-1]}", r"\kappa q", "l/min", flow, why))
    return tuple(out)


def _product(name: str, symbol: str, unit: str, values: np.ndarray, why: str) -> page.ProductRow:
    low, middle, high = _quantiles(values)
    return page.ProductRow(name, symbol, unit, middle, float(np.std(values)), low, high, why)


def mode_rows(done: Calibrated) -> tuple[page.ModeRow, ...]:
    """Modes of the posterior with their weights."""
    z = np.stack([o.z for o in done.found.optima])
    values = values_of(done.problem, z)
    main = ("k_LC", "mu") if done.problem.of_the_rig else ("M_Pl", "mu", "F_C")
    shown = [p for p in done.problem.parameters.sampled if p.base in main]
    return tuple(
        page.ModeRow(
            float(done.weights.weights[i]), float(done.weights.error[i]),
            tuple((p.symbol, p.unit, float(values[p.label][i])) for p in shown),
            f"reached by {o.reached} of {done.found.starts} starts",
        )
        for i, o in enumerate(done.found.optima)
    )  # fmt: skip


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
        commit=commit(),
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
