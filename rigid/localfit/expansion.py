"""Hypotheses simulated side by side in one program, and their likelihoods expanded there.

Slopes of rigs that are not steady are differences: bare simulations take a fifth of the time of
derivatives, and compile in a third. Steps of a steady rig follow it: a difference would now and
then hold one of their jumps, and be taken for a number that the records know to a millionth.
"""

from collections.abc import Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.localfit.families import Family, read, sweep
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout, data_of, flat_readings, split_swept, terms

STEP = 1e-6
"""Change of w, in prior sds, whose difference gives a slope where derivatives cost much. Beside
those, slopes were off by less than 0.1 noise sds (root of the sum over all samples) where their
size was up to 1e5, log evidences by 1e-4."""


class Point(NamedTuple):
    """Where a hypothesis is to be simulated.

    - `hypothesis`; `layout`: of the samples. - `w` (size,); `z_noise` (levels,).
    """

    hypothesis: Hypothesis
    layout: Layout
    w: Float[np.ndarray, " size"]
    z_noise: Float[np.ndarray, " levels"]

    @classmethod
    def beside(cls, local: LocalFit, w: Float[np.ndarray, " size"]) -> "Point":
        """Another point of a hypothesis that has been fitted."""
        return cls(local.hypothesis, local.layout, w, local.z_noise)


class Scene(NamedTuple):
    """A simulation of all records from which some rows are taken.

    - `elsewhere`: rows of all records but this one are; None: all rows. - `absent`: labels of the
      effect that is not there, since it is confined to that record.
    """

    elsewhere: str | None
    absent: tuple[str, ...]


class Swept(NamedTuple):
    """Ideal readings of a point, and their slopes by the hypothesis's numbers."""

    reading: Float[np.ndarray, " n"]
    slopes: Float[np.ndarray, "n numbers"]


def _scenes(hypothesis: Hypothesis) -> list[Scene]:
    """What has to be simulated of a point; effects that are confined to a record take one more."""
    scenes = [Scene(None, ())]
    for effect in hypothesis.added:
        record = hypothesis.only.get(effect.name)
        if record is not None:
            scenes.append(Scene(record, effect.labels()))
    return scenes


def lanes_needed(family: Family, hypothesis: Hypothesis) -> int:
    """Simulations that a point takes: one a direction, itself for differences."""
    along = len(directions(hypothesis))
    each = max(along, 1) if family.steady else 1 + along
    return each * len(_scenes(hypothesis))


def directions(hypothesis: Hypothesis) -> list[list[int]]:
    """Entries of w by which there are slopes, those together that change in one lane.

    A number of one record's own moves nothing of another (`rigid.inference.tangents`), so that one
    such number of each record changes with those of the others.
    """
    shared: list[list[int]] = []
    own: dict[str, list[int]] = {}
    for i, one in enumerate(hypothesis.parameters):
        if one.record:
            own.setdefault(one.record, []).append(i)
        else:
            shared.append([i])
    rows = zip_longest(*own.values())
    return shared + [[i for i in row if i is not None] for row in rows]


def expand(family: Family, points: Sequence[Point]) -> list[LocalFit]:
    """Expand the likelihoods of hypotheses in one sweep of a program that holds them all."""
    found = (_derivatives if family.steady else _differences)(family, points)
    out, at = [], 0
    for point in points:
        scenes = _scenes(point.hypothesis)
        swept = _composed(point.layout, scenes, found[at : at + len(scenes)])
        at += len(scenes)
        out.append(_laid(family, point, swept))
    return out


def expanded(family: Family, point: Point) -> LocalFit:
    """Expand the likelihood of one hypothesis."""
    return expand(family, [point])[0]


def _composed(layout: Layout, scenes: Sequence[Scene], found: Sequence[Swept]) -> Swept:
    """Put the rows of a point together."""
    reading, slopes = found[0]
    for scene, without in zip(scenes[1:], found[1:], strict=True):
        elsewhere = layout.track != layout.tracks.index(scene.elsewhere)
        reading = np.where(elsewhere, without.reading, reading)
        slopes = np.where(elsewhere[:, None], without.slopes, slopes)
    return Swept(reading, slopes)


def _laid(family: Family, point: Point, swept: Swept) -> LocalFit:
    """Expand the likelihood around readings that have been simulated."""
    hypothesis, layout, w, z_noise = point
    spreads = layout.spreads
    own = hypothesis.sensors(w) * spreads
    gain, zero = own[layout.sensor].T
    reading = swept.reading
    residual = data_of(layout) - (1.0 + gain) * reading - zero
    design = np.zeros((len(reading), hypothesis.size))
    design[:, : swept.slopes.shape[1]] = swept.slopes * (1.0 + gain)[:, None]
    rows, at = np.arange(len(reading)), len(hypothesis.parameters) + 2 * layout.sensor
    design[rows, at] = reading * spreads[layout.sensor, 0]
    design[rows, at + 1] = spreads[layout.sensor, 1]
    for here, absorbed, numbers in hypothesis.latent(w):
        residual = residual - absorbed.columns @ numbers
        design[:, here] = absorbed.columns
    found = terms(layout, residual, hypothesis.sigmas(z_noise))
    return LocalFit(hypothesis, family, layout, w, z_noise, reading, residual, found, design)


class Values(NamedTuple):
    """All that a program asks for, in one scene.

    - `every`: SI value by label. - `slope`: by w, of the numbers in w that are there.
    """

    every: dict[str, float]
    slope: dict[str, float]


def _values(family: Family, point: Point) -> list[Values]:
    """Values of each scene of a point."""
    here = point.hypothesis.values(point.w)
    still = dict(family.quiet) | point.hypothesis.constants()
    out = []
    for scene in _scenes(point.hypothesis):
        there = {label: pair for label, pair in here.items() if label not in scene.absent}
        every = still | {label: value for label, (value, _) in there.items()}
        out.append(Values(every, {label: slope for label, (_, slope) in there.items()}))
    return out


def _slopes(
    point: Point, ways: Sequence[Sequence[int]], along: Float[np.ndarray, "n lanes"]
) -> Float[np.ndarray, "n numbers"]:
    """Slopes by each number, in the order of w, from those along directions.

    By a number of one record's own the others have none.
    """
    out = np.zeros((len(along), len(point.hypothesis.parameters)))
    for lane, together in enumerate(ways):
        for i in together:
            record = point.hypothesis.parameters[i].record
            rows = point.layout.of_record(record) if record else slice(None)
            out[rows, i] = along[rows, lane]
    return out


def _differences(family: Family, points: Sequence[Point]) -> list[Swept]:
    """Readings and slopes of every scene of every point, the point itself in its first lane."""
    lanes, asked = [], []
    for point in points:
        ways = directions(point.hypothesis)
        for every, slope in _values(family, point):
            moved = _along(point.hypothesis, ways, slope)
            shifts = ({k: every[k] + STEP * rise for k, rise in one.items()} for one in moved)
            lanes += [every, *(every | shift for shift in shifts)]
            asked.append((point, ways))
    reading = flat_readings(points[0].layout, read(family, _side_by_side(lanes)))
    out, at = [], 0
    for point, ways in asked:
        here, there = reading[:, at], reading[:, at + 1 : at + 1 + len(ways)]
        out.append(Swept(here, _slopes(point, ways, (there - here[:, None]) / STEP)))
        at += 1 + len(ways)
    return out


def _derivatives(family: Family, points: Sequence[Point]) -> list[Swept]:
    """The same by derivatives, one in each lane; a scene without any has a lane all the same."""
    lanes, asked = [], []
    along: list[dict[str, float]] = []
    for point in points:
        ways = directions(point.hypothesis)
        for every, slope in _values(family, point):
            lanes += [every] * max(len(ways), 1)
            along += _along(point.hypothesis, ways, slope) or [{}]
            asked.append((point, ways))
    names = {label for lane in along for label in lane}
    tangents = {name: np.array([lane.get(name, 0.0) for lane in along]) for name in names}
    swept = sweep(family, _side_by_side(lanes), tangents)
    reading, slopes = split_swept(points[0].layout, swept)
    out, at = [], 0
    for point, ways in asked:
        mine = slopes[:, at : at + len(ways)]
        out.append(Swept(reading[:, at], _slopes(point, ways, mine)))
        at += max(len(ways), 1)
    return out


def _along(
    hypothesis: Hypothesis, ways: Sequence[Sequence[int]], slope: dict[str, float]
) -> list[dict[str, float]]:
    """Change of the numbers along each direction, by label; of those that are there."""
    named = ([hypothesis.labels[i] for i in together] for together in ways)
    return [{label: slope[label] for label in labels if label in slope} for labels in named]


def _side_by_side(lanes: Sequence[dict[str, float]]) -> dict[str, np.ndarray]:
    return {label: np.array([lane[label] for lane in lanes]) for label in lanes[0]}
