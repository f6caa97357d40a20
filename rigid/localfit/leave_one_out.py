"""How well hypotheses predict a record from all the others, its own numbers integrated over.

Leaving a record out takes no new fit: around an optimum each sample's log-likelihood is quadratic
in the parameters, so that the fit without some samples is a linear system. Where its top lies far,
and there is a program to do it, the fit is made again without the record. A record's own numbers
(its flow, its preload) are integrated over when it is judged, not plugged in.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from rigid.likelihood.correlation import ahead, noise_law
from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.ascent import descended
from rigid.localfit.expansion import Point, expand
from rigid.localfit.families import Family
from rigid.localfit.integral import Shape, evidence, shape_of
from rigid.localfit.local import LocalFit, with_weights
from rigid.localfit.trust_region import Model, log_factors_of

BLOCKS = 8
"""Parts of a record that an effect confined to it is judged on, each left out in turn."""
FAR = 0.5
"""Prior sds that a number all records share may move before a fit is made again."""
MOST_AGAIN = 6
"""Turns of the program that such a fit gets, at most."""
LEFT_ALONE = 1e-3
"""Share of the prior's information below which a number is not the records' to tell."""

Rows = Bool[np.ndarray, " n"]
Amplitudes = Mapping[str, AbstractPrior]


@dataclasses.dataclass(frozen=True)
class Judged:
    """A hypothesis to be judged: its fit, and its amplitudes as in `shape_of`."""

    local: LocalFit
    amplitudes: Amplitudes = dataclasses.field(default_factory=dict)


class HeldOut(NamedTuple):
    """Log predictive density of each part (parts,), and which were refitted."""

    density: Float[np.ndarray, " parts"]
    refitted: Bool[np.ndarray, " parts"]


class HeldOutFit(NamedTuple):
    """A fit to be made again: without a part's rows, from w moved by `shift` on."""

    name: str
    part: int
    rows: Rows
    shift: Float[np.ndarray, " size"]


def units(local: LocalFit, only: str | None) -> list[Rows]:
    """Rows of each part that is left out in turn: the records, or blocks of the one of `only`.

    Where there is one record alone, its blocks.
    """
    layout = local.layout
    if only is None and len(layout.tracks) == 1:
        only = layout.tracks[0]
    if only is None:
        found = [(layout.track == i) & layout.read for i in range(len(layout.tracks))]
        return [rows for rows in found if rows.any()]
    mine = (layout.track == layout.tracks.index(only)) & layout.read
    edges = np.linspace(layout.time[mine].min(), layout.time[mine].max() + 1e-9, BLOCKS + 1)
    return [mine & (layout.time >= a) & (layout.time < b) for a, b in itertools.pairwise(edges)]


def left_out(
    fits: Mapping[str, Judged], parts: Sequence[Rows], program: Family | None = None
) -> dict[str, HeldOut]:
    """Judge each part by all the others, for several hypotheses.

    - `fits`: by name. - `parts`: rows of each part. - `program`: one that holds the hypotheses;
      without it nothing is fitted again.

    Source: the chain rule, log p(y_u | rest) = log Z(all) - log Z(rest).
    """
    out: dict[str, HeldOut] = {}
    jobs: list[HeldOutFit] = []
    for name, one in fits.items():
        density, far = _by_parabola(one, parts)
        out[name] = HeldOut(density, np.zeros(len(parts), dtype=bool))
        jobs += [HeldOutFit(name, part, parts[part], shift) for part, shift in far.items()]
    if program is None or not jobs:
        return out
    for job, rest in zip(jobs, _again(program, fits, jobs), strict=True):
        local, amplitudes = fits[job.name].local, fits[job.name].amplitudes
        # noise levels are held: what they had under their prior is there with the part and without
        out[job.name].density[job.part] = evidence(local, amplitudes) - evidence(rest, amplitudes)
        out[job.name].refitted[job.part] = True
    return out


def _by_parabola(
    one: Judged, parts: Sequence[Rows]
) -> tuple[Float[np.ndarray, " parts"], dict[int, Float[np.ndarray, " size"]]]:
    """Density of each part (parts,), and how far w moves without those that move it too far."""
    local = one.local
    shape = shape_of(local, one.amplitudes)
    gradient = local.design.T @ local.terms.score
    value = local.terms.value.sum()
    everything = float(shape.integral(gradient, value))
    density, far = np.empty(len(parts)), {}
    for number, rows in enumerate(parts):
        design = local.design[rows]
        rest = shape.without(design.T @ (design * local.terms.curvature[rows, None]))
        asked = gradient - design.T @ local.terms.score[rows]
        density[number] = everything - rest.integral(asked, value - local.terms.value[rows].sum())
        shift = _moved(local, rest, asked)
        told = np.diag(rest.information) > LEFT_ALONE
        told[rest.wide] = False
        if np.abs(shift[_shared(local, rows) & told]).max(initial=0.0) > FAR:
            far[number] = shift
    return density, far


def _moved(
    local: LocalFit, rest: Shape, gradient: Float[np.ndarray, " size"]
) -> Float[np.ndarray, " size"]:
    """How far the top is from w without a part."""
    model = Model(rest.information, gradient, local.w, log_factors_of(local))
    return model.place(model.top(0.0, np.zeros(len(local.w)))) - local.w


def _own(local: LocalFit, rows: Rows) -> Bool[np.ndarray, " size"]:
    """Which numbers belong to the records of some rows alone."""
    layout = local.layout
    return local.hypothesis.own_of({layout.tracks[i] for i in np.unique(layout.track[rows])})


def _shared(local: LocalFit, rows: Rows) -> Bool[np.ndarray, " size"]:
    """Which numbers do not, those of sensors left out."""
    shared = ~_own(local, rows)
    shared[len(local.hypothesis.parameters) :] = False
    return shared


def _again(
    program: Family, fits: Mapping[str, Judged], jobs: Sequence[HeldOutFit]
) -> list[LocalFit]:
    """Fits without some rows, noise levels held."""
    points = []
    for job in jobs:
        local = fits[job.name].local
        less = with_weights(local, np.where(job.rows, 0.0, local.layout.weight))
        longest = max(float(np.abs(job.shift).max()), 1.0)
        points.append(Point.beside(less, local.w + job.shift / longest))
    return descended(program, expand(program, points), MOST_AGAIN)


def held_out_gap(local: LocalFit, parts: Sequence[Rows]) -> float:
    """Root mean square of the residuals of all parts, each predicted by a fit to all the others."""
    squares, count = 0.0, 0
    residual = local.residual.copy()
    for rows in parts:
        residual[rows] -= local.design[rows] @ _without(local, rows)
        scaled = _ahead(local, residual, rows)
        squares, count = squares + float(scaled @ scaled), count + len(scaled)
        residual[rows] = local.residual[rows]
    return float(np.sqrt(squares / max(count, 1)))


def _without(local: LocalFit, rows: Rows) -> Float[np.ndarray, " size"]:
    """Change of w when some rows are left out, their record's own numbers fitted to them."""
    information, gradient = local.information, local.gradient
    design = local.design[rows]
    rest = information - design.T @ (design * local.terms.curvature[rows, None])
    moved = np.linalg.solve(rest, gradient - design.T @ local.terms.score[rows])
    own = _own(local, rows)
    if own.any():
        free, held = np.flatnonzero(own), np.flatnonzero(~own)
        shared = gradient[free] - information[np.ix_(free, held)] @ moved[held]
        moved[free] = np.linalg.solve(information[np.ix_(free, free)], shared)
    return moved


def _ahead(
    local: LocalFit, residual: Float[np.ndarray, " n"], rows: Rows
) -> Float[np.ndarray, " ahead"]:
    """Residuals of some rows one step ahead, over what the sheet allows."""
    layout, out = local.layout, []
    for number in np.unique(layout.channel[rows]):
        mine = (layout.channel == number) & rows
        scaled = residual[mine] / layout.floor[mine]
        good = layout.weight[mine] > 0
        innovations = ahead(noise_law(scaled, good), scaled, good)
        out.append(innovations[np.isfinite(innovations)])
    return np.concatenate(out) if out else np.zeros(0)


def gap(local: LocalFit, rows: Rows | None = None) -> float:
    """Root mean square of the residuals one step ahead, 1 where all is explained."""
    rows = local.layout.read if rows is None else rows
    scaled = _ahead(local, local.residual, rows)
    return float(np.sqrt(np.mean(scaled**2))) if len(scaled) else 0.0
