"""Candidates for the next record, ranked by what each is expected to tell of a quantity."""

import dataclasses
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.inference.adaptation import drawn
from rigid.inference.derived import values_of
from rigid.inference.search_cache import Searched
from rigid.likelihood.problem import Problem, log_density
from rigid.planning.change import Change, changed, own, placed
from rigid.planning.information import (
    Point,
    added,
    at_sensors,
    entries,
    information,
    point,
    sd,
    simulated,
)
from rigid.planning.limits import Beyond, beyond, limits_of, with_settings
from rigid.planning.quantity import Quantity
from rigid.records.record import Record
from rigid.spec import Spec

POINTS = 8
"""Of the posterior, at which the records that there are and the candidates are expanded."""
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
        """5 and 95 % over the points of the posterior."""
        low, high = np.quantile(self.factor[quantity, repeats], [0.05, 0.95])
        return float(low), float(high)

    @property
    def worth(self) -> float:
        """Nats by which the first quantity is known better, for a unit of cost."""
        return -float(np.log(self.expected())) / self.change.cost


@dataclasses.dataclass(frozen=True, eq=False)
class Ranking:
    """All candidates, the worthiest for the first quantity first; those beyond a limit last.

    - `quantities`: their names; `units`. - `median`, `sd` (quantities,): at the points, SI; `sd`
      is that of the records there are, by the local approximation.
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

    - `asked`: quantities by name. - `report(done)`: after each candidate.
    """
    problem = fitted.known.found.problem
    points = _points(fitted.known, np.random.default_rng([seed, 3]))
    slopes = np.array([[q.slope(problem, z) for z in points] for q in asked.values()])
    stays = np.array([q.stays for q in asked.values()])[:, None]
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        places = list(pool.map(partial(point, problem), points))
        now = list(pool.map(partial(information, problem), places))
        before = np.hypot(_sds(now, slopes), np.sqrt(stays))
        ranked = []
        for number, change in enumerate(changes, start=1):
            new = changed(fitted.spec, fitted.records, problem, (change,))
            told = list(pool.map(partial(_told, problem, new, change, seed), places))
            after = [
                np.hypot(
                    _sds([j + n * one.adds for j, one in zip(now, told, strict=True)], slopes),
                    np.sqrt(stays),
                )
                for n in REPEATS
            ]
            factor = np.stack(after, axis=1) / before[:, None]
            most = [one.greatest for one in told]
            ranked.append(Ranked(change, factor, beyond(most, limits_of(fitted.spec, change))))
            report(number)
    ranked.sort(key=lambda one: (one.beyond is not None, -one.worth))
    median = np.array([np.median(quantity.values(points)) for quantity in asked.values()])
    units = tuple(quantity.unit for quantity in asked.values())
    return Ranking(tuple(asked), units, median, np.median(before, axis=1), tuple(ranked))


def _points(known: Searched, rng: np.random.Generator) -> Float[np.ndarray, "points size"]:
    """Points of the posterior: draws of the law over the modes, by their weights."""
    density = known.chart.density(lambda z: log_density(known.found.problem, z))
    found = drawn(density, known.law, rng, DRAWS)
    share = found.weight / found.weight.sum()
    # Systematic: a draw of great weight is taken as often as its weight says, within one.
    places = (rng.uniform() + np.arange(POINTS)) / POINTS
    at = np.searchsorted(np.cumsum(share), places)
    return known.chart.standard(found.z[np.minimum(at, DRAWS - 1)])


def _sds(
    precisions: list[np.ndarray], slopes: np.ndarray
) -> Float[np.ndarray, "quantities points"]:
    """Standard deviation of every quantity at every point."""
    return np.array([[sd(j, g) for j, g in zip(precisions, row, strict=True)] for row in slopes])


class _Told(NamedTuple):
    """What a candidate adds at a point, and the greatest of what it reads and sets."""

    adds: np.ndarray
    greatest: Mapping[str, float]


def _told(base: Problem, new: Problem, change: Change, seed: int, at: Point) -> _Told:
    standard = at_sensors(base, new, at.standard)
    here = Point(placed(base, new, (change,), at.z), standard)
    made, read = simulated(new, here, seed)
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
