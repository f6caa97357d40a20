"""The hidden thing that explains most, as a curve with its simplest formula."""

import numpy as np

from rigid.discovery.unmodelled.bumps import Target
from rigid.discovery.unmodelled.crosstalk import RATES, READINGS, quantities
from rigid.discovery.unmodelled.formula import simplest
from rigid.discovery.unmodelled.straight import FORMS, places
from rigid.discovery.workflow import Outcome, Step
from rigid.localfit.hidden_inputs import UNITS
from rigid.plots.discovery import HiddenShown

WAVE_POINTS = 41

SYMBOLS = {"time": "t", "pressure": "p", "stroke": "x", "speed": "v", "load": "x",
           "cylinder speed": "v"}  # fmt: skip
TARGET_UNITS = {
    "force": "N",
    "drag": "N",
    "flow": "m^3/s",
    "spring": "N",
    "load": "N",
    "stroke": "m",
    "pressure": "Pa",
    "acceleration": "m/s^2",
}
TARGET_NAMES = {
    "force": "hidden force on the plunger",
    "drag": "hidden force on the cylinder",
    "flow": "hidden flow into the chamber",
    "spring": "hidden force of the load-cell end",
    "load": "distortion of the load cell",
    "stroke": "distortion of the stroke sensor",
    "pressure": "distortion of the gauge",
    "acceleration": "distortion of the accelerometer",
}


def hidden_shown(step: Step, outcome: Outcome) -> HiddenShown:
    """The hidden thing that explains most, with its simplest formula."""
    target, bundle = step.explained.likeliest
    mean, covariance = bundle.amplitudes(step.explained.screening.slope)
    if target.period is not None:
        return _wave(target, mean, covariance)
    if target.sort == "shift":
        return _shift(outcome, target, mean, covariance)
    if target.variable in (READINGS, RATES):
        columns = bundle.columns - len(step.explained.listed)
        return _crosstalk(outcome, target, columns, (mean, covariance))
    if target.form:
        return _straight(outcome, target, float(mean[0]), float(np.sqrt(covariance[0, 0])))
    columns = bundle.columns - len(step.explained.listed)
    place = outcome.bench.bumps.centre[columns]
    formula = simplest(place, mean, covariance, SYMBOLS.get(target.variable, "y"))
    order = np.argsort(place, kind="stable")
    return HiddenShown(
        variable=target.variable,
        variable_unit=_unit_of(target),
        name=TARGET_NAMES.get(target.kind, target.kind),
        unit=TARGET_UNITS.get(target.kind, "N"),
        place=place[order],
        mean=mean[order],
        sd=np.sqrt(np.maximum(np.diag(covariance), 0.0))[order],
        formula=formula.values[order],
        words=formula.words,
    )


def _unit_of(target: Target) -> str:
    """Unit of what a hidden thing goes by."""
    if (target.kind, target.variable) == ("spring", "load"):
        return "m"
    return UNITS.get(target.variable, TARGET_UNITS.get(target.kind, "1"))


def _straight(outcome: Outcome, target: Target, number: float, sd: float) -> HiddenShown:
    """A line over the range of what it goes by."""
    place = places(outcome.bench.bumps, target)
    shape = FORMS[target.form](place)
    symbol = SYMBOLS.get(target.variable, "y")
    over = {"constant": "", "proportional": f" {symbol}", "sign": f" sgn({symbol})"}[target.form]
    return HiddenShown(
        variable=target.variable,
        variable_unit=_unit_of(target),
        name=TARGET_NAMES.get(target.kind, target.kind),
        unit=TARGET_UNITS.get(target.kind, "N"),
        place=place,
        mean=number * shape,
        sd=sd * np.abs(shape),
        formula=number * shape,
        words=f"{number:.3g}{over}",
    )


def _shift(
    outcome: Outcome, target: Target, mean: np.ndarray, covariance: np.ndarray
) -> HiddenShown:
    """A constant in each kind of record, as a multiple of that in the kind that knows it best.

    What all kinds have in common the fit has absorbed; records tell of differences alone.

    - `mean` (m,), `covariance` (m, m): of its departures, in prior sds.
    """
    local, bumps = outcome.base, outcome.bench.bumps
    at = local.hypothesis.labels.index(target.kind)
    law, z = local.hypothesis.parameters[at].law, local.w[at]
    mine = [n for n, t in enumerate(bumps.target) if t == target]
    kinds = tuple(local.layout.kinds[int(bumps.centre[n])] for n in mine)
    own = np.diag(covariance)
    first = int(np.argmin(own))
    away = mean - mean[first]
    sd = np.sqrt(np.maximum(own + own[first] - 2.0 * covariance[first], 0.0))
    common = float(law.from_standard(z))
    ratio, upper = (np.asarray(law.from_standard(z + d)) / common for d in (away, away + sd))
    reach = 1.645 * np.abs(upper - ratio)
    told = ", ".join(
        f"{r:.3g} +- {b:.2g} in {kind} records"
        for r, b, kind in zip(ratio, reach, kinds, strict=True)
        if kind != kinds[first]
    )
    return HiddenShown(
        variable=target.variable,
        variable_unit="1",
        name=f"{target.kind} over that in {kinds[first]} records",
        unit="1",
        place=np.arange(len(kinds), dtype=float),
        mean=ratio,
        sd=np.abs(upper - ratio),
        formula=np.ones(len(kinds)),
        words=told,
        groups=kinds,
        model="the same in all records",
    )


def _crosstalk(
    outcome: Outcome, target: Target, columns: np.ndarray, law: tuple[np.ndarray, np.ndarray]
) -> HiddenShown:
    """How much a sensor reads of each other quantity, at the most that the records hold of it.

    - `columns` (m,): of the traces. - `law`: mean (m,) and covariance (m, m) of their numbers.
    """
    mean, sd = law[0], np.sqrt(np.maximum(np.diag(law[1]), 0.0))
    bumps, listed = outcome.bench.bumps, quantities(outcome.base.layout.channels)
    others = [listed[int(n)] for n in bumps.centre[columns]]
    most = np.abs(bumps.columns[:, columns]).max(axis=0)
    own, rate = TARGET_UNITS.get(target.kind, "1"), target.variable == RATES
    units = [TARGET_UNITS.get(other, "1") + "/s" * rate for other in others]
    names = tuple(f"{'rate of ' * rate}{other}" for other in others)
    told = ", ".join(
        f"{number:.3g} {own} per {unit} of the {name}"
        for number, unit, name in zip(mean, units, names, strict=True)
    )
    return HiddenShown(
        variable="the most in any record, by what it answers to",
        variable_unit="1",
        name=TARGET_NAMES.get(target.kind, target.kind),
        unit=own,
        place=np.arange(len(others), dtype=float),
        mean=mean * most,
        sd=sd * most,
        formula=np.zeros(len(others)),
        words=told,
        groups=names,
        model="it answers to its own quantity alone",
    )


def _wave(target: Target, mean: np.ndarray, covariance: np.ndarray) -> HiddenShown:
    """A wave over one period of the stroke, on the cylinder where it is the greater.

    - `mean` (m,), `covariance` (m, m): of a cosine and a sine on each cylinder.
    """
    assert target.period is not None  # the caller asks
    sizes = np.hypot(mean[::2], mean[1::2])
    mine = 2 * int(np.argmax(sizes)) + np.arange(2)
    place = np.linspace(0.0, target.period, WAVE_POINTS)
    turn = 2.0 * np.pi * place / target.period
    basis = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    curve = basis @ mean[mine]
    phase = float(np.arctan2(*mean[mine]))
    return HiddenShown(
        variable=target.variable,
        variable_unit="m",
        name=TARGET_NAMES.get(target.kind, target.kind),
        unit=TARGET_UNITS.get(target.kind, "N"),
        place=place,
        mean=curve,
        sd=np.sqrt(np.einsum("pi,ij,pj->p", basis, covariance[np.ix_(mine, mine)], basis)),
        formula=curve,
        words=f"{sizes.max():.3g} sin(2 pi x/{target.period:.3g} {phase:+.2f})",
    )
