"""A field test from its records to bands and budget, draw after draw."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigid.likelihood.set_aside import Aside
from rigid.smoothing.aside import listed
from rigid.smoothing.budget import Gathered, Line, Tally, Windows, bodies, lines, windows
from rigid.smoothing.field import Field
from rigid.smoothing.jumps import at_once
from rigid.smoothing.kalman import Backward
from rigid.smoothing.laws import RigModel, draws, sheet
from rigid.smoothing.learning import Learned, learn
from rigid.smoothing.mixture import LEVELS, Mixture, Moments, quantiles
from rigid.smoothing.paths import Going, Path, Test, batch_of, left_after, moved_at, stretches, told
from rigid.smoothing.smoother import NOWHERE, Keeping
from rigid.spec import Spec

PART_DRAWS = 24
"""Draws for each part of the budget that is told apart."""

ALONE = ("sensors", "rig")
"""Parts that take draws of their own."""

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
    - `test`: the records and what was learned of each. - `aside`: readings of them that were set
      aside, under any law.
    """

    name: str
    time: np.ndarray
    bands: Mapping[str, Band]
    budget: tuple[Line, ...]
    test: Test
    aside: tuple[Aside, ...] = ()


class Way(NamedTuple):
    """A test under one law: what was learned of it so, and the law with the draws to use."""

    test: Test
    model: RigModel


def learned(
    spec: Spec, fields: Sequence[Field], law: RigModel, report: Callable[[int], None]
) -> tuple[Learned, ...]:
    """Learn of every record how its loads move."""
    out = []
    for field in fields:
        centre = draws(law.centre(), field)
        out.append(learn(field, centre, sheet(spec, law, field.setup), report))
    return tuple(out)


def bands(
    ways: Sequence[Way],
    seed: int,
    keeping: Keeping = NOWHERE,
    apart: bool = True,
) -> Bands:
    """Mix the draws of all laws into bands, and take the uncertainty apart.

    All draws go back over a record together, a stretch at a time, so that what grows with them is a
    few numbers each: the state of the rig, and those of the budget.

    - `ways`: the test under each law, weights summing to 1; all tell the same times. - `keeping`:
      where each stretch is kept, and who is told of each block. - `apart`: whether rig and sensors
      are told apart, which takes more draws.
    """
    test = _best(ways).test
    time, shelf = test.time, keeping.shelf
    at = windows_of(test)
    done: list[_Done] = []
    while (one := shelf.read(_name(len(done)), KEPT, at)) is not None:
        done.append(one)
    sources = _sources(ways, seed, keeping, apart, done)
    tallies = _Tallies(test, at, dict(done[-1].tallies) if done else {})
    made: dict[str, Band] = {}
    for number, where in enumerate(stretches(test)):
        if number < len(done):
            found = done[number].bands
        else:
            found = _stretch(sources, tallies, where)
            later = tuple(going.later for _, going in sources)
            shelf.put(_name(number), _Done(found, tallies.tallies, later), at)
        for name, band in found.items():
            if name not in made:
                made[name] = Band(*(np.empty((len(LEVELS), len(time))) for _ in range(2)))
            made[name].quantiles[:, where] = band.quantiles
            made[name].parts[:, where] = band.parts
    aside = tuple(one for way in ways for one in _aside(way.test))
    budget = tallies.finished(sources)
    return Bands(test.fields[0].name, time, made, budget, test, tuple(dict.fromkeys(aside)))


def windows_of(test: Test) -> dict[str, Windows]:
    """Where failure and rise are, by place; a load that jumped has done so at one instant."""
    jumped, time = moved_at(test), test.time
    out = {}
    for place, load in test.middle.items():
        path, _ = at_once(load[None], load[None], jumped[place])
        out[place] = windows(time, path[0])
    return out


def _aside(test: Test) -> Iterator[Aside]:
    """What was set aside of the records of a test."""
    for field, one in zip(test.fields, test.learned, strict=True):
        yield from listed(field, one.aside)


class _Done(NamedTuple):
    """A stretch that all draws have gone over, and where they were after it.

    - `bands` in it. - `tallies` so far. - `later`: what the samples gone over say, batch by batch.
    """

    bands: Mapping[str, Band]
    tallies: "Mapping[tuple[str, str, int], Tally]"
    later: tuple[tuple[Backward, ...], ...]


KEPT = (_Done, Band, Tally, Gathered, Backward)


def _name(stretch: int) -> str:
    return f"stretch-{stretch:05d}"


def _sources(
    ways: Sequence[Way], seed: int, keeping: Keeping, apart: bool, done: Sequence[_Done]
) -> "list[tuple[_Batch, Going]]":
    """All batches of draws, where those stretches have left them that are done."""
    rng, test = np.random.default_rng([seed, 5]), _best(ways).test
    left, sources = left_after(test, len(done)), []
    for number, batch in enumerate(_batches(ways, apart)):
        seeds = [int(rng.integers(2**31)) for _ in test.fields]
        begun = (left, done[-1].later[number]) if done else None
        way, wide = batch.way, batch_of(batch.of)
        sources.append((batch, Going(way.test, way.model, seeds, wide, keeping, begun)))
    return sources


def _stretch(
    sources: "Sequence[tuple[_Batch, Going]]", tallies: "_Tallies", where: slice
) -> dict[str, Band]:
    """Take all draws over the next stretch, one batch after another."""
    gathering = _Gathering()
    for number, (batch, going) in enumerate(sources):
        found = going.stretch()
        if where.stop > where.start:
            gathering.take(batch, found)
            tallies.take(number, batch, found, where)
        del found  # before the next batch is made
    return gathering.finished()


def blocks(ways: Sequence[Way], apart: bool = True) -> int:
    """How many blocks `bands` goes through, forward and back."""
    once = sum(2 * field.blocks - 1 for field in ways[0].test.fields)
    return once * len(list(_batches(ways, apart)))


def _best(ways: Sequence[Way]) -> Way:
    return max(ways, key=lambda way: way.model.weight)


class _Batch(NamedTuple):
    """Draws that are smoothed together: of `way`, some of the draws of `of`.

    - `part`: what alone varies, or "" where everything does. - `weight`: of each draw. - `law`: its
      number.
    """

    way: Way
    of: RigModel
    part: str
    weight: float
    law: int


def _batches(ways: Sequence[Way], apart: bool) -> Iterator[_Batch]:
    """All draws, batch by batch: those of the bands, then those of the parts."""
    for number, (test, law) in enumerate(ways):
        for one in _parted(law):
            yield _Batch(Way(test, one), law, "", law.weight / law.size, number)
    if not apart:
        return
    best = _best(ways)
    centre, some = best.model.centre(), best.model.only(np.arange(min(PART_DRAWS, best.model.size)))
    for part in ALONE:
        alone = centre.with_sensors_of(some) if part == "sensors" else some.with_sensors_of(centre)
        for one in _parted(alone):
            yield _Batch(Way(best.test, one), alone, part, 1.0, 0)


def _parted(law: RigModel) -> Iterator[RigModel]:
    batch = batch_of(law)
    for first in range(0, law.size, batch):
        yield law.only(np.arange(first, min(first + batch, law.size)))


class _Gathering:
    """Running sums over the draws of a stretch; they do not grow with their number."""

    def __init__(self) -> None:
        self.mixtures: dict[str, dict[int, Mixture]] = {}
        self.sums: dict[tuple[str, str], Moments] = {}

    def take(self, batch: _Batch, found: Mapping[str, Path]) -> None:
        """Take in a batch of draws in which everything varies, or one part alone."""
        for name, path in found.items():
            if batch.part:
                self._sum(name, batch.part, path.mean, 1.0)
                continue
            mixture = self.mixtures.setdefault(name, {}).setdefault(batch.law, Mixture())
            mixture.add(path.mean, path.variance, batch.weight)
            self._sum(name, "mean", path.mean, batch.weight)
            self._sum(name, f"law {batch.law}", path.mean, batch.weight)
            self._sum(name, "smoothed", path.variance, batch.weight)
            self._sum(name, "noise", path.noise**2, batch.weight)

    def _sum(self, name: str, part: str, values: np.ndarray, weight: float) -> None:
        self.sums.setdefault((name, part), Moments()).add(values, weight)

    def finished(self) -> dict[str, Band]:
        """Bands of every quantity in this stretch."""
        return {
            name: Band(quantiles(list(mixtures.values())), self._parts(name))
            for name, mixtures in self.mixtures.items()
        }

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
        alone = [self.sums.get((name, p), nothing).variance for p in ALONE]
        return np.sqrt(np.stack([noise, *alone, form, smoothed - noise]))


class _Tallies:
    """The budget of a test while its stretches go by: a few numbers a draw.

    - `at`: the windows of each place. - `tallies`: those so far.
    """

    def __init__(
        self,
        test: Test,
        at: Mapping[str, Windows],
        tallies: dict[tuple[str, str, int], Tally],
    ):
        self.time, self.at, self.tallies = test.time, at, tallies
        self.jumps = moved_at(test)

    def take(self, number: int, batch: _Batch, found: Mapping[str, Path], where: slice) -> None:
        """Take in a stretch of batch `number`."""
        for body in bodies(found):
            load, place = found[body.load], found[body.displacement]
            paths = {batch.part: (load.mean, place.mean)}
            if not batch.part:
                middle = load.mean.mean(axis=0), place.mean.mean(axis=0)
                moved = place.mean + place.own + place.noise
                paths = {
                    "all": (load.mean + load.own + load.noise, moved),
                    "noise": (middle[0] + load.noise, middle[1] + place.noise),
                    "own": (middle[0] + load.own, middle[1] + place.own),
                }
            jumped = self.jumps[body.place].within(where)
            for part, path in paths.items():
                at = self.at[body.place]
                tally = self.tallies.setdefault((body.place, part, number), Tally(at))
                tally.add(self.time[where], *path, jumped=jumped, first=where.start)

    def finished(self, sources: Sequence[tuple[_Batch, Going]]) -> tuple[Line, ...]:
        """Budgets of all places."""
        batches = [batch for batch, _ in sources]
        whole = [b for b in batches if not b.part]
        weight = np.repeat([b.weight for b in whole], [b.way.model.size for b in whole])
        laws = np.repeat([b.law for b in whole], [b.way.model.size for b in whole])
        out: list[Line] = []
        for place in dict.fromkeys(key[0] for key in self.tallies):
            rows: dict[str, list[np.ndarray]] = {}
            for (where, part, _), tally in self.tallies.items():
                if where == place:
                    rows.setdefault(part, []).append(tally.figures())
            alone = [np.std(np.concatenate(rows[p]), 0) if p in rows else None for p in ALONE]
            noise, own = (_within(rows[p], [b.weight for b in whole]) for p in ("noise", "own"))
            parts = (noise, *alone, own)
            out += lines(place, (np.concatenate(rows["all"]), weight), parts, laws)
        return tuple(out)


def _within(batches: Sequence[np.ndarray], weights: Sequence[float]) -> np.ndarray | None:
    """Sd (5,) about the mean of each batch (draws, 5); None where no batch has two draws.

    Errors are laid over the mean path of their batch, which differs from law to law and a little
    from batch to batch.
    """
    count = sum(w * (len(rows) - 1) for w, rows in zip(weights, batches, strict=True))
    if count == 0.0:
        return None
    squares = [w * np.sum((r - r.mean(0)) ** 2, 0) for w, r in zip(weights, batches, strict=True)]
    return np.sqrt(np.sum(squares, axis=0) / count)


def ways(
    fields: Sequence[Field], found: Sequence[tuple[Learned, ...]], laws: Sequence[RigModel]
) -> tuple[Way, ...]:
    """Put the records of a test together under each law; `found`: learned of them under it.

    What was set aside under a law is not known to it.
    """
    rows = [told(fields, one) for one in found]
    every = rows[0] if len(rows) == 1 else np.unique(np.concatenate(rows))
    return tuple(
        Way(Test(left, one, every, tuple(each.evidence for each in one)), law)
        for one, law in zip(found, laws, strict=True)
        for left in (tuple(f.without(e.aside) for f, e in zip(fields, one, strict=True)),)
    )
