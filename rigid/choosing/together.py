"""Several laws led to their optima side by side: each turn of the program serves them all."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from rigid.discovery.families import Family, sweep
from rigid.discovery.local import (
    LONGEST,
    Local,
    added_size,
    fitted_noise,
    laid,
    with_noise,
)
from rigid.discovery.samples import split_swept

MOST_TURNS = 25
CLOSE = 0.2
"""Done when a step promises less than this in log-posterior: the integral goes on from there to the
top of the parabola."""
SHORTER = 0.3
"""A step that makes it worse is tried again within this share of its length."""
SHORTEST = 0.003
"""Length, in prior sds, below which no more steps are tried."""


@dataclasses.dataclass(frozen=True)
class Place:
    """Where a law is to be simulated.

    - `like`: its fit somewhere else. - `w`: of here. - `known`: whether the slopes by all but the
      added effects' numbers are kept from there.
    """

    like: Local
    w: np.ndarray
    known: bool

    @property
    def lanes(self) -> list[int]:
        """Entries of w by which slopes are asked for."""
        total = len(self.like.hypothesis.parameters)
        first = total - added_size(self.like.hypothesis) if self.known else 0
        return list(range(first, total)) or [0]


def simulated(family: Family, places: Sequence[Place]) -> list[Local]:
    """Expand several laws in one sweep of a program that holds them all."""
    values: dict[str, list[float]] = {}
    tangents: dict[str, list[float]] = {}
    for place in places:
        hypothesis = place.like.hypothesis
        here = hypothesis.values(place.w)
        every = dict(family.quiet) | hypothesis.constants() | {k: v for k, (v, _) in here.items()}
        for number in place.lanes:
            label = hypothesis.labels[number]
            for key, value in every.items():
                values.setdefault(key, []).append(value)
                tangents.setdefault(key, []).append(here[label][1] if key == label else 0.0)
    layout = places[0].like.layout
    swept = sweep(
        family,
        {k: np.array(v) for k, v in values.items()},
        {k: np.array(v) for k, v in tangents.items()},
    )
    reading, slopes = split_swept(layout, swept)
    out, at = [], 0
    for place in places:
        count, like = len(place.lanes), place.like
        known = like.design if place.known else None
        moved = slopes[:, at : at + count]
        kept = len(like.hypothesis.parameters) if known is None else added_size(like.hypothesis)
        where = family, like.layout
        here = (reading[:, at], moved[:, :kept])
        out.append(laid(like.hypothesis, where, (place.w, like.z_noise), here, known))
        at += count
    return out


def led(
    family: Family, found: Sequence[Local], known: bool, turns: int = MOST_TURNS
) -> list[Local]:
    """Lead laws to their optima and their noise levels to theirs.

    - `known`: keep the slopes by all but the added effects' numbers. - `turns`: of the program, at
      most, before the noise levels move; half as many after.
    """
    out = [with_noise(one, fitted_noise(one)) for one in descended(family, found, known, turns)]
    return descended(family, out, known, turns // 2)


def step_within(local: Local, radius: float) -> np.ndarray:
    """Step to the top of the parabola around a fit (size,), no entry of it above `radius`.

    Where the top is further, curvature is added, the same in all directions of w, until it is not:
    Levenberg 1944, Q. Appl. Math. 2; the units are prior sds.
    """
    values, axes = np.linalg.eigh(local.information)
    along = axes.T @ local.gradient

    def step(more: float) -> np.ndarray:
        return axes @ (along / (values + more))

    more = 0.0
    while np.abs(step(more)).max() > radius:
        more = max(3.0 * more, 1e-12 * float(values[-1]))
    return step(more)


def descended(
    family: Family, found: Sequence[Local], known: bool, turns: int = MOST_TURNS
) -> list[Local]:
    """Lead laws uphill, noise levels held, for so many turns of the program at most."""
    out, radius = list(found), [LONGEST] * len(found)
    open_ = set(range(len(out)))
    for _ in range(turns):
        steps = {i: step_within(out[i], radius[i]) for i in open_}
        open_ = {i for i in open_ if 0.5 * steps[i] @ out[i].gradient > CLOSE}
        if not open_:
            break
        order = sorted(open_)
        tried = simulated(family, [Place(out[i], out[i].w + steps[i], known) for i in order])
        for i, one in zip(order, tried, strict=True):
            if np.isfinite(one.value) and one.value > out[i].value:
                out[i], radius[i] = one, min(2.0 * radius[i], LONGEST)
            else:
                radius[i] = SHORTER * min(radius[i], float(np.abs(steps[i]).max()))
                if radius[i] < SHORTEST:
                    open_.discard(i)
    return out
