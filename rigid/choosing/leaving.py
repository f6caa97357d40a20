"""How well each law predicts a record from all the others, its own numbers integrated over.

log p(y_u | rest) = log Z(all) - log Z(rest). Without a record the parabola around the fit to all is
less bent, its top elsewhere. Where it lies far, the fit is made again without the record.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigid.choosing.integral import evidence, shape_of
from rigid.choosing.together import Place, descended, simulated
from rigid.discovery.families import Family
from rigid.discovery.local import Local, with_weights
from rigid.priors import AbstractLaw

FAR = 0.5
"""Prior sds that a number all records share may move before a fit is made again."""
MOST_AGAIN = 6
"""Turns of the program that such a fit gets, at most."""
LEFT_ALONE = 1e-3
"""Share of the prior's information below which a number is not the records' to tell."""

Amplitudes = Mapping[str, AbstractLaw]


class Left(NamedTuple):
    """Log predictive density of each part (parts,), and which were refitted."""

    density: np.ndarray
    refitted: np.ndarray


def left_out(
    family: Family | None, local: Local, amplitudes: Amplitudes, parts: Sequence[np.ndarray]
) -> Left:
    """Judge each part by all the others.

    - `family`: the program that holds the law; without one nothing is fitted again.
    - `amplitudes`: as in `shape_of`. - `parts`: rows of each part.
    """
    shape = shape_of(local, amplitudes)
    pull = local.design.T @ local.terms.score
    value = local.terms.value.sum()
    everything = float(shape.integral(pull, value))
    density, moved = np.empty(len(parts)), {}
    for number, rows in enumerate(parts):
        design = local.design[rows]
        rest = shape.without(design.T @ (design * local.terms.bend[rows, None]))
        asked = pull - design.T @ local.terms.score[rows]
        density[number] = everything - rest.integral(asked, value - local.terms.value[rows].sum())
        known = rest.information + np.eye(len(local.w))
        shift = np.linalg.solve(known, asked - local.w)
        shared = _shared(local, rows) & (np.diag(known) > 1.0 + LEFT_ALONE)
        if np.abs(shift[shared]).max(initial=0.0) > FAR:
            moved[number] = shift
    jobs = {n: (parts[n], shift) for n, shift in moved.items()}
    exact = {} if family is None else _again(family, local, jobs)
    for number, rest in exact.items():
        prior = (
            0.5 * local.z_noise @ local.z_noise
        )  # of the noise levels, the same without the part
        density[number] = everything - (evidence(rest, amplitudes) + prior)
    return Left(density, np.array([n in exact for n in range(len(parts))]))


def _shared(local: Local, rows: np.ndarray) -> np.ndarray:
    """Which numbers do not belong to the records of some rows alone (size,)."""
    tracks = {local.layout.tracks[i] for i in np.unique(local.layout.track[rows])}
    labels = local.hypothesis.labels
    own = [label.endswith("]") and label.split("[")[1][:-1] in tracks for label in labels]
    return np.concatenate([~np.array(own), np.zeros(len(local.w) - len(labels), dtype=bool)])


def _again(
    family: Family, local: Local, jobs: Mapping[int, tuple[np.ndarray, np.ndarray]]
) -> dict[int, Local]:
    """Fits without some rows, noise levels held, by number of the part; empty for no jobs."""
    if not jobs:
        return {}
    known = bool(local.hypothesis.added)
    places = []
    for rows, shift in jobs.values():
        less = with_weights(local, np.where(rows, 0.0, local.layout.weight))
        longest = max(float(np.abs(shift).max()), 1.0)
        places.append(Place(less, local.w + shift / longest, known))
    begun = simulated(family, places)
    ends = descended(family, begun, known, MOST_AGAIN)
    return dict(zip(jobs, ends, strict=True))
