"""A field test from its records to bands and budget, draw after draw."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigid.smoothing.budget import Bodies, Line, Windows, bodies, figures, lines, windows
from rigid.smoothing.field import Field
from rigid.smoothing.laws import Law, draws, sheet
from rigid.smoothing.learning import Learned, learn
from rigid.smoothing.mixture import Mixture, Moments, quantiles
from rigid.smoothing.paths import Path, Test, quantities, told
from rigid.spec import Spec

DRAWS = 128
"""Draws of the posterior in a band."""

PART_DRAWS = 24
"""Draws for each part of the budget that is told apart."""

PART_NAMES = ("noise", "sensors", "rig", "form", "own")
"""Parts of the variance at every time, as `budget.PARTS` orders them."""


@dataclass(frozen=True, eq=False)
class Band:
    """One quantity over time.

    - `quantiles` (5, times): 5, 25, 50, 75 and 95 %. - `parts` (5, times): standard deviations by
      PART_NAMES.
    """

    quantiles: np.ndarray
    parts: np.ndarray


@dataclass(frozen=True, eq=False)
class Bands:
    """All that is known of one field test.

    - `name`; `time` (times,) [s]; `bands` by quantity, such as `load_A`; `budget`.
    - `test`: the records and what was learned of each.
    """

    name: str
    time: np.ndarray
    bands: Mapping[str, Band]
    budget: tuple[Line, ...]
    test: Test


class Way(NamedTuple):
    """A test under one law: what was learned of it so, and the law with the draws to use."""

    test: Test
    law: Law


def learned(
    spec: Spec, fields: Sequence[Field], law: Law, report: Callable[[int], None]
) -> tuple[Learned, ...]:
    """Learn of every cylinder's record how its load moves."""
    out = []
    for field in fields:
        centre = draws(law.centre(), field)
        out.append(learn(field, centre, sheet(spec, law, field.cylinder), report))
    return tuple(out)


def bands(
    ways: Sequence[Way],
    seed: int,
    report: Callable[[int], None] = lambda _: None,
    apart: bool = True,
) -> Bands:
    """Mix the draws of all laws into bands, and take the uncertainty apart.

    - `ways`: the test under each law, weights summing to 1; all tell the same times. - `report`: is
      told each batch. - `apart`: whether rig and sensors are told apart, which takes more draws.
    """
    rng = np.random.default_rng([seed, 5])
    best = max(ways, key=lambda way: way.law.weight)
    gathering = _Gathering(best.test)
    for number, (test, law) in enumerate(ways):
        for batch in _batches(law, test.batch):
            gathering.whole(quantities(test, batch, rng), law.weight / law.size, number)
            report(1)
    centre = best.law.centre()
    for part in ("sensors", "rig") if apart else ():
        some = best.law.only(np.arange(min(PART_DRAWS, best.law.size)))
        alone = centre.with_sensors_of(some) if part == "sensors" else some.with_sensors_of(centre)
        for batch in _batches(alone, best.test.batch):
            gathering.part(part, quantities(best.test, batch, rng))
            report(1)
    return gathering.finished()


def passes(ways: Sequence[Way]) -> int:
    """How many batches `bands` goes through."""
    best = max(ways, key=lambda way: way.law.weight)
    parts = 2 * -(-min(PART_DRAWS, best.law.size) // best.test.batch)
    return sum(-(-way.law.size // way.test.batch) for way in ways) + parts


def _batches(law: Law, batch: int) -> Iterator[Law]:
    for first in range(0, law.size, batch):
        yield law.only(np.arange(first, min(first + batch, law.size)))


class _Gathering:
    """Running sums over draws; nothing grows with their number but the budget's few numbers."""

    def __init__(self, test: Test):
        self.test, self.time = test, test.time
        self.mixtures: dict[str, dict[int, Mixture]] = {}
        self.sums: dict[tuple[str, str], Moments] = {}
        self.figures: dict[tuple[str, str], list[np.ndarray]] = {}
        self.weights: list[float] = []
        self.laws: list[int] = []
        self.windows: dict[str, Windows] = {}

    def whole(self, found: Mapping[str, Path], weight: float, law: int) -> None:
        """Take in a batch of draws in which everything varies; `weight` of each draw."""
        for name, path in found.items():
            mixture = self.mixtures.setdefault(name, {}).setdefault(law, Mixture())
            mixture.add(path.mean, path.variance, weight)
            self._sum(name, "mean", path.mean, weight)
            self._sum(name, f"law {law}", path.mean, weight)
            self._sum(name, "smoothed", path.variance, weight)
            self._sum(name, "noise", path.noise**2, weight)
        for body in bodies(found):
            self._figures(body, found)
        count = len(next(iter(found.values())).mean)
        self.weights += [weight] * count
        self.laws += [law] * count

    def part(self, part: str, found: Mapping[str, Path]) -> None:
        """Take in a batch in which one part alone varies."""
        for name, path in found.items():
            self._sum(name, part, path.mean, 1.0)
        for body in bodies(found):
            self._figure(body, part, found[body.load].mean, found[body.displacement].mean)

    def _sum(self, name: str, part: str, values: np.ndarray, weight: float) -> None:
        self.sums.setdefault((name, part), Moments()).add(values, weight)

    def _figures(self, body: Bodies, found: Mapping[str, Path]) -> None:
        load, place = found[body.load], found[body.displacement]
        if body.place not in self.windows:
            self.windows[body.place] = windows(self.time, load.mean.mean(axis=0))
        all_load = load.mean + load.own + load.noise
        self._figure(body, "all", all_load, place.mean + place.own + place.noise)
        middle = load.mean.mean(axis=0), place.mean.mean(axis=0)
        self._figure(body, "noise", middle[0] + load.noise, middle[1] + place.noise)
        self._figure(body, "own", middle[0] + load.own, middle[1] + place.own)

    def _figure(self, body: Bodies, part: str, load: np.ndarray, place: np.ndarray) -> None:
        found = figures(self.time, load, place, self.windows[body.place])
        self.figures.setdefault((body.place, part), []).append(found)

    def finished(self) -> Bands:
        """Put everything together."""
        made = {
            name: Band(quantiles(list(mixtures.values())), self._parts(name))
            for name, mixtures in self.mixtures.items()
        }
        weight, laws = np.array(self.weights), np.array(self.laws)
        listed = []
        for place in self.windows:
            rows = {p: np.concatenate(v) for (w, p), v in self.figures.items() if w == place}
            parts = tuple(rows.get(p) for p in ("noise", "sensors", "rig", "own"))
            listed += lines(place, (rows["all"], weight), parts, laws)
        return Bands(self.test.fields[0].name, self.time, made, tuple(listed), self.test)

    def _parts(self, name: str) -> np.ndarray:
        """Standard deviations by PART_NAMES, (5, times)."""
        smoothed, noise = self.sums[name, "smoothed"].mean, self.sums[name, "noise"].mean
        noise = np.minimum(noise, smoothed)
        form = np.zeros_like(noise)
        each = [m for (n, p), m in self.sums.items() if n == name and p.startswith("law ")]
        if len(each) > 1:
            overall = self.sums[name, "mean"].mean
            total = sum(m.weight for m in each)
            form = sum((m.weight * (m.mean - overall) ** 2 for m in each), start=form) / total
        nothing = Moments(squares=np.zeros_like(noise))
        alone = [self.sums.get((name, p), nothing).variance for p in ("sensors", "rig")]
        return np.sqrt(np.stack([noise, *alone, form, smoothed - noise]))


def ways(
    fields: Sequence[Field], found: Sequence[tuple[Learned, ...]], laws: Sequence[Law]
) -> tuple[Way, ...]:
    """Put the cylinders of a test together under each law; `found`: learned of them under it."""
    rows = [told(fields, one) for one in found]
    every = rows[0] if len(rows) == 1 else np.unique(np.concatenate(rows))
    return tuple(
        Way(Test(tuple(fields), one, every), law) for one, law in zip(found, laws, strict=True)
    )
