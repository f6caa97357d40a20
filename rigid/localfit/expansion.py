"""Hypotheses simulated side by side in one program, and their likelihoods expanded there.

Slopes of rigs that are not steady are differences: bare simulations take a fifth of the time of
derivatives, and compile in a third. Steps of a steady rig follow it: a difference would now and
then hold one of their jumps, and be taken for a number that the records know to a millionth.
"""

import dataclasses
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


@dataclasses.dataclass(frozen=True)
class Program:
    """A compiled program, and where slopes come from.

    - `family`: simulates hypotheses, and gives all slopes where there is no
    - `plain`: the program of the model without what the hypotheses add, whose turns cost next to
      nothing: slopes by all numbers but the added effects' are taken from it, at the same values.
    """

    family: Family
    plain: Family | None = None

    def own(self, hypothesis: Hypothesis) -> list[int]:
        """Entries of w by which `family` gives slopes."""
        total = len(hypothesis.parameters)
        return list(range(0 if self.plain is None else total - added_size(hypothesis), total))

    def lanes(self, hypothesis: Hypothesis) -> int:
        """Simulations by `family` that a point takes: one a direction, itself for differences."""
        own = len(self.directions(hypothesis))
        each = max(own, 1) if self.family.steady else 1 + own
        return each * len(_scenes(hypothesis))

    def directions(self, hypothesis: Hypothesis) -> list[list[int]]:
        """Entries of w by which `family` gives slopes, those together that change in one lane.

        A number of one record's own moves nothing of another (`rigid.inference.tangents`), so that
        one such number of each record changes with those of the others.
        """
        shared: list[list[int]] = []
        own: dict[str, list[int]] = {}
        for i in self.own(hypothesis):
            record = hypothesis.parameters[i].record
            if record:
                own.setdefault(record, []).append(i)
            else:
                shared.append([i])
        rows = zip_longest(*own.values())
        return shared + [[i for i in row if i is not None] for row in rows]


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
    """Ideal readings of a point, and their slopes by the entries that the program has slopes of."""

    reading: Float[np.ndarray, " n"]
    slopes: Float[np.ndarray, "n own"]


def _scenes(hypothesis: Hypothesis) -> list[Scene]:
    """What has to be simulated of a point; effects that are confined to a record take one more."""
    scenes = [Scene(None, ())]
    for effect in hypothesis.added:
        record = hypothesis.only.get(effect.name)
        if record is not None:
            scenes.append(Scene(record, effect.labels()))
    return scenes


def expand(program: Program, points: Sequence[Point]) -> list[LocalFit]:
    """Expand the likelihoods of hypotheses in one sweep of a program that holds them all."""
    found = (_derivatives if program.family.steady else _differences)(program, points)
    out, at = [], 0
    for point, known in zip(points, _known_slopes(program, points), strict=True):
        scenes = _scenes(point.hypothesis)
        swept = _composed(point.layout, scenes, found[at : at + len(scenes)])
        at += len(scenes)
        out.append(_laid(program.family, point, swept, known))
    return out


def expanded(family: Family, point: Point) -> LocalFit:
    """Expand the likelihood of one hypothesis, all slopes by the program's own derivatives."""
    return expand(Program(family), [point])[0]


def _composed(layout: Layout, scenes: Sequence[Scene], found: Sequence[Swept]) -> Swept:
    """Put the rows of a point together."""
    reading, slopes = found[0]
    for scene, without in zip(scenes[1:], found[1:], strict=True):
        elsewhere = layout.track != layout.tracks.index(scene.elsewhere)
        reading = np.where(elsewhere, without.reading, reading)
        slopes = np.where(elsewhere[:, None], without.slopes, slopes)
    return Swept(reading, slopes)


def _laid(
    family: Family, point: Point, swept: Swept, known: Float[np.ndarray, "n size"] | None
) -> LocalFit:
    """Expand the likelihood around readings that have been simulated.

    - `known`: slopes by all but the added effects' numbers, where `swept` has them by those alone.
    """
    hypothesis, layout, w, z_noise = point
    base = len(hypothesis.parameters) - added_size(hypothesis)
    spreads = layout.spreads
    own = hypothesis.sensors(w) * spreads
    gain, zero = own[layout.sensor].T
    reading = swept.reading
    residual = data_of(layout) - (1.0 + gain) * reading - zero
    design = np.zeros((len(reading), hypothesis.size))
    if known is not None:
        design[:, :base] = known[:, :base]
    first = base if known is not None else 0
    design[:, first : first + swept.slopes.shape[1]] = swept.slopes * (1.0 + gain)[:, None]
    rows, at = np.arange(len(reading)), len(hypothesis.parameters) + 2 * layout.sensor
    design[rows, at] = reading * spreads[layout.sensor, 0]
    design[rows, at + 1] = spreads[layout.sensor, 1]
    found = terms(layout, residual, hypothesis.sigmas(z_noise))
    return LocalFit(hypothesis, family, layout, w, z_noise, reading, residual, found, design)


def added_size(hypothesis: Hypothesis) -> int:
    """Number of parameters of what was added."""
    inside = {p.label for p in hypothesis.problem.parameters.sampled}
    return sum(p.label not in inside for p in hypothesis.parameters)


class Values(NamedTuple):
    """All that a program asks for, in one scene.

    - `every`: SI value by label. - `slope`: by w, of the numbers in w that are there.
    """

    every: dict[str, float]
    slope: dict[str, float]


def _values(program: Program, point: Point) -> list[Values]:
    """Values of each scene of a point."""
    here = point.hypothesis.values(point.w)
    still = dict(program.family.quiet) | point.hypothesis.constants()
    out = []
    for scene in _scenes(point.hypothesis):
        there = {label: pair for label, pair in here.items() if label not in scene.absent}
        every = still | {label: value for label, (value, _) in there.items()}
        out.append(Values(every, {label: slope for label, (_, slope) in there.items()}))
    return out


def _slopes(
    point: Point, directions: Sequence[Sequence[int]], along: Float[np.ndarray, "n lanes"]
) -> Float[np.ndarray, "n own"]:
    """Slopes by each number, in the order of w, from those along directions.

    By a number of one record's own the others have none.
    """
    places = sorted(i for together in directions for i in together)
    out = np.zeros((len(along), len(places)))
    for lane, together in enumerate(directions):
        for i in together:
            record = point.hypothesis.parameters[i].record
            rows = point.layout.of_record(record) if record else slice(None)
            out[rows, places.index(i)] = along[rows, lane]
    return out


def _differences(program: Program, points: Sequence[Point]) -> list[Swept]:
    """Readings and slopes of every scene of every point, the point itself in its first lane."""
    lanes, asked = [], []
    for point in points:
        directions = program.directions(point.hypothesis)
        for every, slope in _values(program, point):
            moved = _along(point.hypothesis, directions, slope)
            shifts = ({k: every[k] + STEP * rise for k, rise in one.items()} for one in moved)
            lanes += [every, *(every | shift for shift in shifts)]
            asked.append((point, directions))
    reading = flat_readings(points[0].layout, read(program.family, _side_by_side(lanes)))
    out, at = [], 0
    for point, directions in asked:
        here, there = reading[:, at], reading[:, at + 1 : at + 1 + len(directions)]
        out.append(Swept(here, _slopes(point, directions, (there - here[:, None]) / STEP)))
        at += 1 + len(directions)
    return out


def _derivatives(program: Program, points: Sequence[Point]) -> list[Swept]:
    """The same by derivatives, one in each lane; a scene without any has a lane all the same."""
    lanes, asked = [], []
    along: list[dict[str, float]] = []
    for point in points:
        directions = program.directions(point.hypothesis)
        for every, slope in _values(program, point):
            lanes += [every] * max(len(directions), 1)
            along += _along(point.hypothesis, directions, slope) or [{}]
            asked.append((point, directions))
    names = {label for lane in along for label in lane}
    tangents = {name: np.array([lane.get(name, 0.0) for lane in along]) for name in names}
    swept = sweep(program.family, _side_by_side(lanes), tangents)
    reading, slopes = split_swept(points[0].layout, swept)
    out, at = [], 0
    for point, directions in asked:
        mine = slopes[:, at : at + len(directions)]
        out.append(Swept(reading[:, at], _slopes(point, directions, mine)))
        at += max(len(directions), 1)
    return out


def _along(
    hypothesis: Hypothesis, directions: Sequence[Sequence[int]], slope: dict[str, float]
) -> list[dict[str, float]]:
    """Change of the numbers along each direction, by label; of those that are there."""
    named = ([hypothesis.labels[i] for i in together] for together in directions)
    return [{label: slope[label] for label in labels if label in slope} for labels in named]


def _side_by_side(lanes: Sequence[dict[str, float]]) -> dict[str, np.ndarray]:
    return {label: np.array([lane[label] for lane in lanes]) for label in lanes[0]}


def _known_slopes(
    program: Program, points: Sequence[Point]
) -> Sequence[Float[np.ndarray, "n size"] | None]:
    """Slopes of each point's readings by what it has from the model without what was added."""
    if program.plain is None:
        return [None] * len(points)
    bare = []
    for point in points:
        full = point.hypothesis
        total, base = len(full.parameters), len(full.parameters) - added_size(full)
        w = np.concatenate([point.w[:base], point.w[total:]])
        bare.append(point._replace(hypothesis=full.alone, w=w))
    return [one.design for one in expand(Program(program.plain), bare)]
