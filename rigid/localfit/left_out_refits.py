"""How well each law predicts a record from all the others, its own numbers integrated over.

log p(y_u | rest) = log Z(all) - log Z(rest). Without a record the parabola around the fit to all is
less bent, its top elsewhere. Where it lies far, the fit is made again without the record.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigid.likelihood.priors import AbstractLaw
from rigid.localfit.integral import Shape, evidence, shape_of
from rigid.localfit.joint_ascent import Place, Program, descended, simulated
from rigid.localfit.local import Local, with_weights
from rigid.localfit.trust_region import Model, bent_of

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


class Job(NamedTuple):
    """A fit to be made again: of a law, without a part's rows, from w moved by `shift` on."""

    law: str
    part: int
    rows: np.ndarray
    shift: np.ndarray


def left_out(
    program: Program | None,
    fits: Mapping[str, tuple[Local, Amplitudes]],
    parts: Sequence[np.ndarray],
) -> dict[str, Left]:
    """Judge each part by all the others, for several laws.

    - `program`: the one that holds the laws; without it nothing is fitted again. - `fits`: by name
      of the law, with its amplitudes as in `shape_of`. - `parts`: rows of each part.
    """
    out: dict[str, Left] = {}
    jobs: list[Job] = []
    for name, (local, amplitudes) in fits.items():
        density, far = _by_parabola(local, amplitudes, parts)
        out[name] = Left(density, np.zeros(len(parts), dtype=bool))
        jobs += [Job(name, part, parts[part], shift) for part, shift in far.items()]
    if program is None or not jobs:
        return out
    for job, rest in zip(jobs, _again(program, fits, jobs), strict=True):
        local, amplitudes = fits[job.law]
        # noise levels are held: what they had under their prior is there with the part and without
        out[job.law].density[job.part] = evidence(local, amplitudes) - evidence(rest, amplitudes)
        out[job.law].refitted[job.part] = True
    return out


def _by_parabola(
    local: Local, amplitudes: Amplitudes, parts: Sequence[np.ndarray]
) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Density of each part (parts,), and how far w moves without those that move it too far."""
    shape = shape_of(local, amplitudes)
    pull = local.design.T @ local.terms.score
    value = local.terms.value.sum()
    everything = float(shape.integral(pull, value))
    density, far = np.empty(len(parts)), {}
    for number, rows in enumerate(parts):
        design = local.design[rows]
        rest = shape.without(design.T @ (design * local.terms.bend[rows, None]))
        asked = pull - design.T @ local.terms.score[rows]
        density[number] = everything - rest.integral(asked, value - local.terms.value[rows].sum())
        shift = _moved(local, rest, asked)
        told = np.diag(rest.information) > LEFT_ALONE
        told[rest.wide] = False
        if np.abs(shift[_shared(local, rows) & told]).max(initial=0.0) > FAR:
            far[number] = shift
    return density, far


def _moved(local: Local, rest: Shape, pull: np.ndarray) -> np.ndarray:
    """How far the top is from w (size,) without a part."""
    model = Model(rest.information, pull, local.w, bent_of(local))
    return model.place(model.top(0.0, np.zeros(len(local.w)))) - local.w


def _shared(local: Local, rows: np.ndarray) -> np.ndarray:
    """Which numbers do not belong to the records of some rows alone (size,)."""
    tracks = {local.layout.tracks[i] for i in np.unique(local.layout.track[rows])}
    shared = ~local.hypothesis.own_of(tracks)
    shared[len(local.hypothesis.parameters) :] = False
    return shared


def _again(
    program: Program, fits: Mapping[str, tuple[Local, Amplitudes]], jobs: Sequence[Job]
) -> list[Local]:
    """Fits without some rows, noise levels held."""
    places = []
    for job in jobs:
        local, _ = fits[job.law]
        less = with_weights(local, np.where(job.rows, 0.0, local.layout.weight))
        longest = max(float(np.abs(job.shift).max()), 1.0)
        places.append(Place.beside(less, local.w + job.shift / longest))
    return descended(program, simulated(program, places), MOST_AGAIN)
