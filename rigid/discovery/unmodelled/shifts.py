"""Constants that are not: one number of the rig would have to differ between kinds of records.

A plate that swings in a release alone, a hose that takes pressure from free runs: what acts in one
kind of record and not in the others makes constants disagree that the model holds equal. No force
over time or over a state stands for that. The traces cost nothing: they are the slopes that the fit
has, each kind's rows alone.
"""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from rigid.discovery.unmodelled.bumps import KINDS, Bumps, Target
from rigid.effects import AbstractEffect
from rigid.effects.base import PLUNGER
from rigid.likelihood.parameters import Parameter
from rigid.localfit.local import Local

EQUATIONS = {
    "M_HC": "cylinder-momentum",
    "M_Pl": PLUNGER,
    "M_Fl": PLUNGER,
    "S_Pl": PLUNGER,
    "L_0": "oil-balance",
    "k_frame": "contact",
}
"""Equation in which each constant of the rig itself stands."""


def shifts(local: Local) -> Bumps:
    """Traces of every constant's departure in each kind of record, per prior sd.

    `centre` is the number of the kind. A constant that acts in one kind alone has none.
    """
    layout = local.layout
    rows = [layout.of_kinds((kind,)) for kind in layout.kinds]
    listed = constants(local.hypothesis.parameters, layout.problem.effects, layout.tracks)
    return shifted(local.design, rows, listed)


def constants(
    parameters: Sequence[Parameter],
    effects: Sequence[type[AbstractEffect]],
    tracks: Collection[str],
) -> dict[int, Target]:
    """Numbers of a fit that are held equal in all records, by their place.

    - `tracks`: labels of the records, some of which have numbers of their own.
    """
    equations = EQUATIONS | {
        label: effect.equation
        for effect in effects
        for info in effect.parameters()
        for label in info.labels
    }
    return {
        i: Target(one.label, equations.get(one.label, PLUNGER), KINDS)
        for i, one in enumerate(parameters)
        if not one.varies and one.label.split("[")[-1].rstrip("]") not in tracks
    }


def shifted(design: np.ndarray, rows: Sequence[np.ndarray], listed: Mapping[int, Target]) -> Bumps:
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
    traces = np.stack(columns, axis=1) if columns else none
    return Bumps(traces, tuple(targets), np.array(centres, dtype=float))
