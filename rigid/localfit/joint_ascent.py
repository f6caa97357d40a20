"""Several laws led to their optima side by side: each turn of the program serves them all."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rigid.localfit.families import Family, read, sweep
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.local import LONGEST, STEP, Local, added_size, fitted_noise, laid, with_noise
from rigid.localfit.samples import Layout, flat_readings, split_swept
from rigid.localfit.trust_region import model_of, moved_within, promised

MOST_TURNS = 25
CLOSE = 0.2
"""Done when a step promises less than this in log-posterior: the integral goes on from there to the
top of the parabola."""
SHORTER, POOR = 0.3, 0.25
"""After a step that brings less than the second share of what it promised, the next has at most the
first share of its length; so has each further step that is tried in the same turn."""
MOST_TRIES = 4
"""Steps of one law that are tried in one turn, where lanes are free."""
SHORTEST = 0.003
"""Length, in prior sds, below which no more steps are tried."""


class Program(NamedTuple):
    """A compiled program, and where slopes come from.

    - `family`: simulates laws. - `plain`: the program of the model without what the laws add, whose
      turns cost next to nothing: slopes by all numbers but the added effects' are taken from it, at
      the same values of these numbers. None: all slopes are those of `family`.
    """

    family: Family
    plain: Family | None = None

    def own(self, hypothesis: Hypothesis) -> list[int]:
        """Entries of w by which `family` gives slopes."""
        total = len(hypothesis.parameters)
        return list(range(0 if self.plain is None else total - added_size(hypothesis), total))

    def lanes(self, hypothesis: Hypothesis) -> int:
        """Simulations by `family` that a place takes: one a slope, and itself for differences."""
        own = len(self.own(hypothesis))
        return max(own, 1) if self.family.steady else 1 + own


class Place(NamedTuple):
    """Where a law is to be simulated.

    - `hypothesis`; `layout`: of the samples. - `w` (size,); `z_noise` (levels,).
    """

    hypothesis: Hypothesis
    layout: Layout
    w: np.ndarray
    z_noise: np.ndarray

    @classmethod
    def beside(cls, local: Local, w: np.ndarray) -> "Place":
        """Another place of a law that has been fitted."""
        return cls(local.hypothesis, local.layout, w, local.z_noise)


class Climb(NamedTuple):
    """How far a fit has come.

    - `best`: the highest so far. - `here`: where the next step begins. - `radius`: how far a step
      from the highest may go.

    Records of a thousand noise sds bend every valley: a step along it ends beside it, lower, but
    with slopes by which the next one may end further up than where both began. So from a place
    that is lower, but promises more, one further step is taken before it is given up (the watchdog
    of Chamberlain, Powell, Lemarechal and Pedersen 1982, Math. Program. Study 16).
    """

    best: Local
    here: Local
    radius: float

    @property
    def open(self) -> bool:
        """Whether there is more to come.

        It is the model's top, however far, that tells: a step that is short because longer ones
        have failed promises little wherever the top is.
        """
        if self.here is not self.best:
            return True
        return self.radius >= SHORTEST and promised(self.best) > CLOSE

    @property
    def reach(self) -> float:
        """How far the next step may go."""
        return self.radius if self.here is self.best else LONGEST

    def after(self, tried: Sequence[tuple[np.ndarray, float, Local]]) -> "Climb":
        """Where it goes on after steps, what they promised, and what came of them."""
        lengths = [float(np.abs(step).max()) for step, _, _ in tried]
        heights = [one.value if np.isfinite(one.value) else -np.inf for _, _, one in tried]
        top = int(np.argmax(heights))
        _, gain, one = tried[top]
        straight = self.here is self.best
        if heights[top] > self.best.value:
            poor = heights[top] - self.here.value < POOR * gain
            longer = SHORTER * lengths[top] if poor else min(2.0 * lengths[top], LONGEST)
            return Climb(one, one, max(longer, self.radius) if not straight else longer)
        if straight and np.isfinite(heights[0]):
            first = tried[0][2]
            if first.value + promised(first) > self.best.value + CLOSE:
                return Climb(self.best, first, lengths[-1])
        return Climb(self.best, self.best, SHORTER * (lengths[-1] if straight else self.radius))


def simulated(program: Program, places: Sequence[Place]) -> list[Local]:
    """Expand several laws in one sweep of a program that holds them all.

    Slopes of rigs that are not steady are differences: bare simulations take a fifth of the time of
    derivatives, and compile in a third. Steps of a steady rig follow it: a difference would now and
    then hold one of their jumps, and be taken for a number that the records know to a millionth.
    """
    sweep_of = _derivatives if program.family.steady else _differences
    reading, slopes = sweep_of(program, places)
    out, at, first = [], 0, 0
    for place, design in zip(places, _plain_slopes(program, places), strict=True):
        own = len(program.own(place.hypothesis))
        where, here = (program.family, place.layout), (place.w, place.z_noise)
        mine = slopes[:, first : first + own]
        out.append(laid(place.hypothesis, where, here, (reading[:, at], mine), design))
        at, first = at + program.lanes(place.hypothesis), first + own
    return out


def _differences(program: Program, places: Sequence[Place]) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n, lanes) and slopes (n, own entries of all places), one after the other."""
    lanes = [lane for place in places for lane in _moved_by_little(program, place)]
    reading = flat_readings(places[0].layout, read(program.family, _side_by_side(lanes)))
    slopes, at = [], 0
    for place in places:
        end = at + program.lanes(place.hypothesis)
        slopes.append((reading[:, at + 1 : end] - reading[:, at : at + 1]) / STEP)
        at = end
    return reading, np.concatenate(slopes, axis=1)


def _derivatives(program: Program, places: Sequence[Place]) -> tuple[np.ndarray, np.ndarray]:
    """The same by derivatives, one in each lane; a place without any has a lane all the same."""
    lanes, kept = [], []
    along: dict[str, list[float]] = {}
    for place in places:
        every, here = _values(program, place)
        moved = [place.hypothesis.labels[i] for i in program.own(place.hypothesis)]
        kept += range(len(lanes), len(lanes) + len(moved))
        for label in moved or [""]:
            lanes.append(every)
            for name in every:
                along.setdefault(name, []).append(here[name][1] if name == label else 0.0)
    tangents = {name: np.array(series) for name, series in along.items()}
    swept = sweep(program.family, _side_by_side(lanes), tangents)
    reading, slopes = split_swept(places[0].layout, swept)
    return reading, slopes[:, kept]


def _side_by_side(lanes: Sequence[dict[str, float]]) -> dict[str, np.ndarray]:
    return {label: np.array([lane[label] for lane in lanes]) for label in lanes[0]}


def _values(
    program: Program, place: Place
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Values of all that the program asks for, and of those in w with their slopes by w."""
    here = place.hypothesis.values(place.w)
    every = dict(program.family.quiet) | place.hypothesis.constants()
    return every | {label: value for label, (value, _) in here.items()}, here


def _moved_by_little(program: Program, place: Place) -> list[dict[str, float]]:
    """Values of each simulation that a place takes, the place itself first."""
    every, here = _values(program, place)
    moved = [place.hypothesis.labels[i] for i in program.own(place.hypothesis)]
    return [every, *(every | {k: here[k][0] + STEP * here[k][1]} for k in moved)]


def _plain_slopes(program: Program, places: Sequence[Place]) -> list[np.ndarray | None]:
    """Slopes of each law's readings by what it has from the model without it, at its own place."""
    if program.plain is None:
        return [None] * len(places)
    bare = []
    for place in places:
        full = place.hypothesis
        total, base = len(full.parameters), len(full.parameters) - added_size(full)
        w = np.concatenate([place.w[:base], place.w[total:]])
        bare.append(place._replace(hypothesis=full.alone, w=w))
    return [one.design for one in simulated(Program(program.plain), bare)]


def led(program: Program, found: Sequence[Local], turns: int = MOST_TURNS) -> list[Local]:
    """Lead laws to their optima and their noise levels to theirs.

    - `turns`: of the program, at most, before the noise levels move; half as many after.
    """
    return settled(program, descended(program, found, turns), turns // 2)


def settled(program: Program, found: Sequence[Local], turns: int) -> list[Local]:
    """Lead noise levels to their optima, then laws to theirs."""
    return descended(program, [with_noise(one, fitted_noise(one)) for one in found], turns)


def descended(program: Program, found: Sequence[Local], turns: int = MOST_TURNS) -> list[Local]:
    """Lead laws uphill, noise levels held, for so many turns of the program at most."""
    climbs = [Climb(one, one, LONGEST) for one in found]
    for _ in range(turns):
        open_ = [i for i, climb in enumerate(climbs) if climb.open]
        if not open_:
            break
        needed = sum(program.lanes(climbs[i].here.hypothesis) for i in open_)
        tries = min(MOST_TRIES, max(1, program.family.lanes // needed))
        steps = {i: _steps(climbs[i].here, climbs[i].reach, tries) for i in open_}
        places = [
            Place.beside(climbs[i].here, climbs[i].here.w + step)
            for i in open_
            for step, _ in steps[i]
        ]
        tried = iter(simulated(program, places))
        for i in open_:
            climbs[i] = climbs[i].after([(*pair, next(tried)) for pair in steps[i]])
    return [climb.best for climb in climbs]


def _steps(local: Local, radius: float, tries: int) -> list[tuple[np.ndarray, float]]:
    """Steps of w, each SHORTER than the one before, and what they promise."""
    model = model_of(local)
    found = [moved_within(model, radius)]
    for _ in range(tries - 1):
        found.append(moved_within(model, SHORTER * float(np.abs(found[-1][0]).max())))
    return found
