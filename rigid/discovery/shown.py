"""The hidden thing that explains most, as a curve with its simplest formula."""

import numpy as np

from rigid.discovery.bumps import Target
from rigid.discovery.formula import simplest
from rigid.discovery.hidden import UNITS
from rigid.discovery.workflow import Outcome, Step
from rigid.plots.discovery import HiddenShown

WAVE_POINTS = 41

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
    found = step.explained
    target, bundle = found.bundles[int(np.argmax(found.bundle))]
    mean, covariance = bundle.amplitudes(found.screening.slope)
    if target.period is not None:
        return _wave(target, mean, covariance)
    columns = bundle.columns - len(found.listed)
    place = outcome.bench.bumps.centre[columns]
    symbol = {"time": "t", "pressure": "p", "stroke": "x", "speed": "v", "load": "x",
              "cylinder speed": "v"}  # fmt: skip
    formula = simplest(place, mean, covariance, symbol.get(target.variable, "y"))
    order = np.argsort(place, kind="stable")
    unit = UNITS.get(target.variable, TARGET_UNITS.get(target.kind, "1"))
    if (target.kind, target.variable) == ("spring", "load"):
        unit = "m"
    return HiddenShown(
        variable=target.variable,
        variable_unit=unit,
        name=TARGET_NAMES.get(target.kind, target.kind),
        unit=TARGET_UNITS.get(target.kind, "N"),
        place=place[order],
        mean=mean[order],
        sd=np.sqrt(np.maximum(np.diag(covariance), 0.0))[order],
        formula=formula.values[order],
        words=formula.words,
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
