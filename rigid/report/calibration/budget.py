"""The uncertainty budget of a fit's key numbers, in the form of the GUM."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rigid.inference.calibrate import Calibrated
from rigid.likelihood.parameters import Parameter
from rigid.physics.sensors import UNITS
from rigid.report.calibration.output import friction_at
from rigid.report.content import BudgetLine, GumBudget, KeyNumber

SILENT = 0.1
"""Share of its prior that a parameter has to lose for the records to have spoken of it."""

LEAST_SHARE = 0.01
"""Of the variance, from which on a contribution has a line of its own."""

REPEATED = "scatter of the readings, through the fit"
OTHERS = "all other known quantities"


def silent(done: Calibrated) -> tuple[Parameter, ...]:
    """Parameters of which the records say nothing: they keep their priors."""
    z = done.draws.z.reshape(-1, done.draws.z.shape[-1])
    kept = 1.0 - z.std(axis=0)
    sampled = done.problem.parameters.sampled
    return tuple(p for p, share in zip(sampled, kept, strict=True) if share < SILENT)


def budgets(done: Calibrated, numbers: Sequence[KeyNumber]) -> tuple[GumBudget, ...]:
    """A budget for each key number that is a parameter, and for the friction at a few frequencies.

    Type B are the quantities that keep what was known of them before: parameters of which the
    records say nothing, gains and zeros of the sensors. Their sensitivities are the coefficients of
    a linear regression of the number on them over the draws of the posterior; what is left, the
    scatter of the residuals, is type A.

    Source: JCGM 100:2008 (GUM), 4.3, 5.1.3 and annex H; as a regression over draws, JCGM 101:2008.
    """
    units = {p.label: p.unit for p in done.problem.parameters.sampled}
    inputs = {p.label: done.kept[p.label].ravel() for p in silent(done)}
    for label, pair in done.sensors.items():
        quantity = label.split(",")[0]
        for name, unit, series in zip(("gain", "zero"), ("1", UNITS[quantity]), pair, strict=True):
            inputs[f"{name}[{label}]"], units[f"{name}[{label}]"] = series.ravel(), unit
    named = {number.name for number in numbers if number.name}
    asked = {name: draws for name, draws in done.kept.items() if name in named - set(inputs)}
    frictions = {at.label: draws for at, draws in friction_at(done, kept=True).items()}
    units |= dict.fromkeys(frictions, "N s/m")
    return tuple(
        _budget(name, units[name], draws.ravel(), inputs, units)
        for name, draws in (asked | frictions).items()
        if draws.std() > 0.0
    )


def _budget(
    label: str,
    unit: str,
    values: Float[np.ndarray, " draws"],
    inputs: dict[str, np.ndarray],
    units: dict[str, str],
) -> GumBudget:
    """The budget of one number."""
    used = {k: v for k, v in inputs.items() if v.std() > 0.0}
    scaled = [(v - v.mean()) / v.std() for v in used.values()]
    design = np.reshape(scaled, (len(used), len(values))).T  # no column where all is told or exact
    centred = values - values.mean()
    slopes, *_ = np.linalg.lstsq(design, centred, rcond=None)
    rest = float(np.std(centred - design @ slopes))
    total = float(values.std())
    shares = {
        name: BudgetLine(
            source=name,
            kind="B",
            estimate=float(used[name].mean()),
            uncertainty=float(used[name].std()),
            unit=units[name],
            sensitivity=float(slope / used[name].std()),
            contribution=abs(float(slope)),
        )
        for name, slope in zip(used, slopes, strict=True)
    }
    shown = [one for one in shares.values() if one.contribution**2 >= LEAST_SHARE * total**2]
    small = [one.contribution for one in shares.values() if one not in shown]
    lines = sorted(shown, key=lambda one: -one.contribution)
    others = BudgetLine(OTHERS, "B", None, None, "", None, float(np.sqrt(np.sum(np.square(small)))))
    repeated = BudgetLine(REPEATED, "A", None, None, "", None, rest)
    return GumBudget(
        label, unit, float(values.mean()), total, (*lines, *([others] if small else []), repeated)
    )
