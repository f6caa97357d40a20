"""Constants that are not: one number of the rig would have to differ between kinds of records.

A plate that swings in a release alone, a hose that takes pressure from free runs: what acts in one
kind of record and not in the others makes constants disagree that the model holds equal. No force
over time or over a state stands for that. The signatures cost nothing: they are the slopes that the
fit has, each kind's rows alone.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, AbstractHidden, Bumps, Inferred
from rigid.effects import AbstractEffect
from rigid.effects.base import PLUNGER
from rigid.likelihood.parameters import Parameter
from rigid.localfit.hidden_inputs import Abscissa
from rigid.plots.shown import HiddenShown

EQUATIONS = {
    "M_HC": "cylinder-momentum",
    "M_Pl": PLUNGER,
    "M_Fl": PLUNGER,
    "S_Pl": PLUNGER,
    "L_0": "oil-balance",
    "k_frame": "contact",
}
"""Equation in which each constant of the rig itself stands."""


@dataclasses.dataclass(frozen=True)
class Shift(AbstractHidden):
    """A constant that differs between kinds of records.

    - `kind`: its label. - `equation`: in which it stands.
    """

    kind: str
    equation: str

    sort: ClassVar[str] = "shift"
    order: ClassVar[int] = 4

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:  # noqa: ARG003
        """Every constant's departure in each kind of record, per prior sd.

        `centre` is the number of the kind. A constant that acts in one kind alone has none.
        """
        local, layout = fit.local, fit.local.layout
        rows = [layout.of_kinds((kind,)) for kind in layout.kinds]
        listed = constants(local.hypothesis.parameters, layout.problem.effects)
        return shifted(local.design, rows, listed)

    @property
    def about(self) -> About:
        """What it is."""
        return About(self.equation, self.kind, "1", Abscissa("kind of record", "1"))

    def shown(self, found: Inferred) -> HiddenShown:
        """The constant in each kind of record over that in the kind that knows it best.

        What all kinds have in common the fit has absorbed; records tell of differences alone.
        """
        local, mean, covariance = found.local, found.mean, found.covariance
        at = local.hypothesis.labels.index(self.kind)
        prior, z = local.hypothesis.parameters[at].prior, local.w[at]
        kinds = tuple(local.layout.kinds[int(number)] for number in found.own.centre)
        own = np.diag(covariance)
        first = int(np.argmin(own))
        away = mean - mean[first]
        sd = np.sqrt(np.maximum(own + own[first] - 2.0 * covariance[first], 0.0))
        common = float(prior.from_standard(z))
        ratio, upper = (np.asarray(prior.from_standard(z + d)) / common for d in (away, away + sd))
        reach = 1.645 * np.abs(upper - ratio)
        told = ", ".join(
            f"{r:.3g} +- {b:.2g} in {kind} records"
            for r, b, kind in zip(ratio, reach, kinds, strict=True)
            if kind != kinds[first]
        )
        place, same = np.arange(len(kinds), dtype=float), np.ones(len(kinds))
        shown = self.drawn(place, ratio, np.abs(upper - ratio), same, told)
        name = f"{self.kind} over that in {kinds[first]} records"
        return dataclasses.replace(shown, name=name, groups=kinds, model="the same in all records")


def constants(
    parameters: Sequence[Parameter], effects: Sequence[type[AbstractEffect]]
) -> dict[int, Shift]:
    """Numbers of a fit that are held equal in all records, by their place."""
    equations = EQUATIONS | {label: one.equation for one in effects for label in one.labels()}
    return {
        i: Shift(one.label, equations.get(one.label, PLUNGER))
        for i, one in enumerate(parameters)
        if not one.varies and not one.record
    }


def shifted(
    design: Float[np.ndarray, "n size"], rows: Sequence[np.ndarray], listed: Mapping[int, Shift]
) -> Bumps:
    """Columns of a design (n, size) in the rows (n,) of each kind alone, where they are not 0."""
    columns, targets, centres = [], [], []
    for i, target in listed.items():
        felt = [n for n, mine in enumerate(rows) if np.any(design[mine, i])]
        if len(felt) < 2:
            continue
        columns += [np.where(rows[n], design[:, i], 0.0) for n in felt]
        targets += [target] * len(felt)
        centres += felt
    none = np.zeros((len(design), 0))
    signatures = np.stack(columns, axis=1) if columns else none
    return Bumps(signatures, tuple(targets), np.array(centres, dtype=float))
