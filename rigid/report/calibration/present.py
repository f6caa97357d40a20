"""From a calibration to what its page shows; all numbers are worked out here or before."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from rigid.inference.alternatives import alternatives
from rigid.inference.calibrate import Calibrated
from rigid.inference.derived import values_of
from rigid.inference.summary import Result
from rigid.likelihood.parameters import Parameter
from rigid.plots.metrology import significant
from rigid.report import content as page
from rigid.report.calibration.budget import budgets
from rigid.report.calibration.for_paper import for_paper
from rigid.report.calibration.front import front
from rigid.report.calibration.output import At, friction_at
from rigid.report.calibration.shown import channel_fit, corner, friction_curve, roots_shown, traces
from rigid.report.made import made
from rigid.report.paper_values import (
    KAPPA,
    Published,
    of_the_paper,
    published,
    published_frictions,
)
from rigid.report.taken import sentences
from rigid.spec import Spec

PAPER_KAPPA = " and ".join(f"{k.value:g} ({k.place.split(', ', 2)[2]})" for k in KAPPA)


def content(spec: Spec, done: Calibrated, found: Result) -> page.CalibrationContent:
    """Gather all that the section on a calibration shows."""
    checks = tuple(found.checks)
    numbers, choices = key_numbers(spec, done), alternatives(spec, done)
    rows, curve = parameter_rows(done, found), friction_curve(done)
    return page.CalibrationContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        front=front(done, checks, numbers, choices, curve),
        provenance=provenance(spec, done, found),
        checks=checks,
        taken=sentences(found.taken),
        usable=found.usable,
        key_numbers=numbers,
        parameters=rows,
        fits=tuple(channel_fit(done, c) for c in done.shown),
        records=record_notes(done),
        gap=found.gap.overall,
        products=products(done),
        alternatives=choices,
        modes=mode_rows(done),
        friction=curve,
        draws=corner(done),
        traces=traces(done),
        weighed=done.draws.weighed,
        roots=roots_shown(done),
        budgets=budgets(done, numbers),
        paper=for_paper(spec, done, found, numbers, choices),
    )


def _quantiles(values: np.ndarray) -> tuple[float, float, float]:
    low, middle, high = (float(q) for q in np.percentile(values, [5, 50, 95]))
    return low, middle, high


def _key(
    label: str,
    symbol: str,
    unit: str,
    values: np.ndarray,
    published: tuple[Published, ...] = (),
    reading: str = "",
) -> page.KeyNumber:
    """One of the key numbers, from its draws."""
    low, middle, high = _quantiles(values)
    sd = float(np.std(values))
    return page.KeyNumber(label, symbol, unit, middle, sd, low, high, published, reading)


def _published(done: Calibrated, label: str) -> tuple[Published, ...]:
    return published(label, of_the_paper(done.problem))


def key_numbers(spec: Spec, done: Calibrated) -> tuple[page.KeyNumber, ...]:
    """The few numbers people come for; of another machine all that are no noise."""
    if done.problem.of_the_rig:
        return _of_the_rig(done)
    return tuple(
        dataclasses.replace(
            _key(_worded(spec, p), p.symbol, _unit(p), done.values[p.label]), name=p.label
        )
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
        dataclasses.replace(
            _key(stiffness, "k_{LC}", p.unit, done.values[p.label], _published(done, "k_LC")),
            name=p.label,
        )
        for p in sampled
        if p.base == "k_LC"
    ]
    ours = of_the_paper(done.problem)
    out += frictions(friction_at(done), published_frictions(ours))
    for base, worded in (("kappa", "valve open"), ("kappa_tank", "valve to the tank")):
        listed = [done.values[p.label] for p in sampled if p.base == base]
        out += flow_fractions(worded, listed, ours and base == "kappa")
    return tuple(out)


def flow_fractions(worded: str, found: Sequence[np.ndarray], ours: bool) -> list[page.KeyNumber]:
    """Flow fractions of all valve settings of a sort in one row; none where there are none.

    - `worded`: which settings. - `found`: draws of each. - `ours`: whether the paper gives some.
    """
    if not found:
        return []
    own = "Each record's own valve setting" + (f"; the paper gives {PAPER_KAPPA}" if ours else "")
    ends = [_quantiles(values) for values in found]
    middle = np.array([m for _, m, _ in ends])
    number = _key(f"flow fraction, {worded}", r"\kappa", "-", found[0], (), own)
    if len(found) == 1:
        return [number]
    low, high = significant(float(middle.min()), "-"), significant(float(middle.max()), "-")
    return [
        dataclasses.replace(
            number,
            label=f"flow fractions, {worded} ({len(found)} settings)",
            q05=min(low for low, _, _ in ends),
            q95=max(high for _, _, high in ends),
            range=f"{low} to {high}",
            reading=f"{number.reading}; each stands under Parameters",
        )
    ]


def frictions(
    found: Mapping[At, np.ndarray], printed: Sequence[tuple[float | None, Published]]
) -> list[page.KeyNumber]:
    """Friction at both ends of what is on record; once where it is the same at all frequencies.

    - `found`: draws of |mu| [N s/m], as `friction_at` gives them. - `printed`: what the paper says
      of mu, the first of the fast one.
    """
    views: dict[str, list[tuple[float, np.ndarray]]] = {}
    for at, values in found.items():
        views.setdefault(at.view, []).append((at.hertz, values))
    out = []
    for view, listed in views.items():
        said = f" ({view})" if view else ""
        (_, slow), (hertz, fast) = min(listed, key=_frequency), max(listed, key=_frequency)
        if np.allclose(slow, fast, rtol=1e-9, atol=0.0):
            out.append(_friction(f"friction, whatever the frequency{said}", r"\mu", slow, printed))
            continue
        out.append(_friction(f"friction in steady running{said}", r"\mu(0)", slow, printed[1:]))
        symbol = rf"|\mu({hertz:g}\,\mathrm{{Hz}})|"
        out.append(_friction(f"friction at {hertz:g} Hz{said}", symbol, fast, printed[:1]))
    return out


def _frequency(one: tuple[float, np.ndarray]) -> float:
    return one[0]


def _friction(
    name: str, symbol: str, values: np.ndarray, printed: Sequence[tuple[float | None, Published]]
) -> page.KeyNumber:
    """One coefficient of friction beside the printed ones of its frequency."""
    return _key(name, symbol, "N s/m", values, tuple(p for _, p in printed))


def parameter_rows(done: Calibrated, found: Result) -> tuple[page.ParameterShown, ...]:
    """Prior beside posterior for every sampled parameter."""
    figures = {row.name: row.summary for row in found.parameters}
    z = done.draws.z.reshape(-1, done.draws.z.shape[-1])
    places = np.array([-1.6449, 0.0, 1.6449])
    beforehand = values_of(done.problem, np.tile(places[:, None], z.shape[1]))
    out = []
    for i, p in enumerate(done.problem.parameters.sampled):
        low, middle, high = sorted(map(float, beforehand[p.label]))
        out.append(page.ParameterShown(
            **vars(figures[p.label]), name=p.label, symbol=p.numbered_symbol, unit=_unit(p),
            prior_median=middle, prior_q05=low, prior_q95=high,
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


def products(done: Calibrated) -> tuple[page.KeyNumber, ...]:
    """Combinations that the records identify better than their parts."""
    if not done.problem.of_the_rig:
        return ()
    ratio = done.values["k_oil"] / done.values["L_0"]
    why = "only k_oil/(L_0 + x) enters (eq. 21): the parts keep much of their priors"
    return (_key("k_oil / L_0", r"k_\mathrm{oil}/L_0", "Pa/m", ratio, reading=why),)


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


def provenance(spec: Spec, done: Calibrated, found: Result) -> page.Provenance:
    """Enough to make the page again."""
    read = [(r.path.name, r.sha256) for r in done.records]
    return made(spec, done.seed, read, **found.cost.values())
