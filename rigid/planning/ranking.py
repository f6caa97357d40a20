"""Candidates for the next record, ranked by what each is expected to tell of a quantity."""

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.inference.adaptation import drawn
from rigid.inference.derived import values_of
from rigid.inference.newton import is_noise
from rigid.inference.search_cache import Searched
from rigid.likelihood.problem import Problem, log_density
from rigid.planning.change import Change, anew, changed, own, placed
from rigid.planning.information import (
    Point,
    added,
    at_sensors,
    entries,
    information,
    point,
    sd,
    shift,
    simulated,
)
from rigid.planning.limits import Beyond, beyond, limits_of, with_settings
from rigid.planning.quantity import Quantity
from rigid.records.record import Record
from rigid.spec import Spec

POINTS = 8
"""Of the posterior, at which the records that there are and the candidates are expanded."""
LEADING, CLOSER = 3, 20
"""Candidates that are weighed a second time, and at how many other points."""
DRAWS = 256
"""Of the law over the modes, of which the points are taken by their weights."""
REPEATS = (1, 2, 4)


@dataclasses.dataclass(frozen=True, eq=False)
class Ranked:
    """One candidate.

    - `change`. - `factor` (quantities, repeats, points): sd of each quantity with so many of
      REPEATS such records over the sd without, by point of the posterior.
    - `beyond`: what would be read or set beyond its limit; None: nothing.
    """

    change: Change
    factor: Float[np.ndarray, "quantities repeats points"]
    beyond: Beyond | None

    def expected(self, quantity: int = 0, repeats: int = 0) -> float:
        """Median over the posterior of the factor."""
        return float(np.median(self.factor[quantity, repeats]))

    def within(self, quantity: int = 0, repeats: int = 0) -> tuple[float, float]:
        """What one more point lies between in nine cases of ten; of few points least and most."""
        low, high = np.quantile(self.factor[quantity, repeats], [0.05, 0.95], method="weibull")
        return float(low), float(high)

    @property
    def worth(self) -> float:
        """Nats by which the first quantity is known better, for a unit of cost."""
        return -float(np.log(self.expected())) / self.change.cost


@dataclasses.dataclass(frozen=True, eq=False)
class Ranking:
    """All candidates, the worthiest for the first quantity first; those beyond a limit last.

    The first LEADING were weighed anew: they are in order among themselves, and stay in front.

    - `quantities`: their names; `units`. - `median` (quantities,): over the posterior. - `sd`
      (quantities,): by the records there are, around the best fit. Both SI.
    """

    quantities: tuple[str, ...]
    units: tuple[str, ...]
    median: Float[np.ndarray, " quantities"]
    sd: Float[np.ndarray, " quantities"]
    ranked: tuple[Ranked, ...]

    @property
    def possible(self) -> tuple[Ranked, ...]:
        """Candidates that can be taken."""
        return tuple(one for one in self.ranked if one.beyond is None)


class Fitted(NamedTuple):
    """What is asked of: a spec, its records, and the law of their posterior."""

    spec: Spec
    records: tuple[Record, ...]
    known: Searched


def rank(
    fitted: Fitted,
    asked: Mapping[str, Quantity],
    changes: tuple[Change, ...],
    seed: int,
    report: Callable[[int], None] = lambda _: None,
) -> Ranking:
    """Rank candidates by what they are expected to tell.

    The first of two dozen is likely one whose expectation is too good: the first LEADING are
    weighed anew at other points, and that is what they promise.

    - `asked`: quantities by name. - `report(done)`: after each candidate that is weighed.
    """
    rng = np.random.default_rng([seed, 3])
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        every = _Around(fitted, asked, points_of(fitted.known, rng, POINTS), seed, pool)
        ranked = []
        for number, change in enumerate(changes, start=1):
            ranked.append(every.ranked(change))
            report(number)
        ranked.sort(key=_order)
        closer = _Around(fitted, asked, points_of(fitted.known, rng, CLOSER), seed, pool)
        best = _Around(fitted, asked, fitted.known.found.optima[0].z[None], seed, pool)
        for place, one in enumerate(ranked[:LEADING]):
            if one.beyond is None:
                ranked[place] = closer.foreseen(one.change, best)
            report(len(changes) + place + 1)
    # In front stay those that were weighed anew: behind them chance has not been taken out.
    ranked[:LEADING] = sorted(ranked[:LEADING], key=_order)
    median = np.array([np.median(quantity.values(closer.points)) for quantity in asked.values()])
    units = tuple(quantity.unit for quantity in asked.values())
    return Ranking(tuple(asked), units, median, best.sds(best.now)[:, 0], tuple(ranked))


def weighed(changes: tuple[Change, ...]) -> int:
    """How often `rank` weighs a candidate."""
    return len(changes) + min(LEADING, len(changes))


def _order(one: Ranked) -> tuple[bool, float]:
    return one.beyond is not None, -one.worth


@dataclasses.dataclass(frozen=True, eq=False)
class _Around:
    """Points of the posterior, and what the records there are tell at each.

    - `points` (points, size). - `seed`: of simulated readings. - `pool`: works at points at once.
    """

    fitted: Fitted
    asked: Mapping[str, Quantity]
    points: Float[np.ndarray, "points size"]
    seed: int
    pool: ThreadPoolExecutor

    @cached_property
    def places(self) -> list[Point]:
        """The points, with gains and zeros."""
        return list(self.pool.map(partial(point, self.problem), self.points))

    @cached_property
    def now(self) -> list[np.ndarray]:
        """Precision of what is known, at each."""
        return list(self.pool.map(partial(information, self.problem), self.places))

    @property
    def problem(self) -> Problem:
        """Of the records that there are."""
        return self.fitted.known.found.problem

    def told(self, change: Change) -> "list[_Told]":
        """What a candidate tells at each point."""
        new = changed(self.fitted.spec, self.fitted.records, self.problem, (change,))
        each = range(len(self.points))
        tell = partial(_told, self.problem, new, change)
        return list(self.pool.map(tell, [(self.seed, i) for i in each], self.places))

    def sds(self, precisions: Sequence[np.ndarray]) -> Float[np.ndarray, "quantities points"]:
        """Standard deviation of every quantity at every point under precisions there."""
        known = [[sd(j, g) for j, g in zip(precisions, row, strict=True)] for row in self._slopes]
        stays = np.array([q.stays for q in self.asked.values()])[:, None]
        return np.hypot(np.array(known), np.sqrt(stays))

    @cached_property
    def _slopes(self) -> np.ndarray:
        listed = self.asked.values()
        return np.array([[q.slope(self.problem, z) for z in self.points] for q in listed])

    def ranked(self, change: Change) -> Ranked:
        """Weigh a candidate: the sd with it over that without, at each point."""
        return self._ranked(change, self, self.told(change), self.sds(self.now))

    def foreseen(self, change: Change, best: "_Around") -> Ranked:
        """Weigh a candidate where a fit with it may come to lie, if the truth is at the points.

        - `best`: the best fit of today, over whose sd that there is.
        """
        rng = np.random.default_rng([self.seed, 4])
        (middle,), free = best.points, ~is_noise(self.problem)
        ends = np.tile(middle, (len(self.points), 1))
        for end, z, j, one in zip(ends, self.points, self.now, self.told(change), strict=True):
            off = np.zeros(len(j))
            off[: free.sum()] = (z - middle)[free]
            end[free] += shift(j, one.adds, off, rng)[: free.sum()]
        there = _Around(self.fitted, self.asked, ends, self.seed, self.pool)
        return self._ranked(change, there, there.told(change), best.sds(best.now))

    def _ranked(
        self, change: Change, there: "_Around", told: "list[_Told]", before: np.ndarray
    ) -> Ranked:
        after = [
            there.sds([j + n * one.adds for j, one in zip(there.now, told, strict=True)])
            for n in REPEATS
        ]
        factor = np.stack(after, axis=1) / before[:, None]
        most = [one.greatest for one in told]
        return Ranked(change, factor, beyond(most, limits_of(self.fitted.spec, change)))


def points_of(
    known: Searched, rng: np.random.Generator, count: int
) -> Float[np.ndarray, "points size"]:
    """Points of the posterior: draws of the law over the modes, by their weights."""
    density = known.chart.density(lambda z: log_density(known.found.problem, z))
    found = drawn(density, known.law, rng, DRAWS)
    share = found.weight / found.weight.sum()
    # Systematic: a draw of great weight is taken as often as its weight says, within one.
    places = (rng.uniform() + np.arange(count)) / count
    at = np.searchsorted(np.cumsum(share), places)
    return known.chart.standard(found.z[np.minimum(at, DRAWS - 1)])


class _Told(NamedTuple):
    """What a candidate adds at a point, and the greatest of what it reads and sets."""

    adds: np.ndarray
    greatest: Mapping[str, float]


def _told(base: Problem, new: Problem, change: Change, seed: tuple[int, int], at: Point) -> _Told:
    rng = np.random.default_rng(seed)
    standard = at_sensors(base, new, at.standard)
    here = Point(anew(new, change, placed(base, new, (change,), at.z), rng), standard)
    made, read = simulated(new, here, rng)
    private = own(new, change)
    values = values_of(new, here.z[None])
    set_there = [(p, float(values[p.label][0])) for p in private]
    greatest = with_settings(read, new, change, set_there)
    listed, before = entries(new), entries(base)
    apart = {p.label for p in private} | {*listed} - {*before}
    places = np.array([i for i, name in enumerate(listed) if name in apart], dtype=int)
    adds = added(information(made, here), places)
    shared = [listed.index(name) for name in before]
    return _Told(adds[np.ix_(shared, shared)], greatest)
