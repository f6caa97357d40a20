"""A fit where candidates stand in place of the records that they are like."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from rigid.likelihood.problem import Problem
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import Family
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout, lay_out
from rigid.localfit.settled import labels_of
from rigid.planning.change import Change, changed, moved, stated
from rigid.planning.limits import Beyond, beyond, limits_of, with_settings
from rigid.planning.pool import pool
from rigid.records.record import Record
from rigid.spec import Spec


class Possible(NamedTuple):
    """What could be taken: candidates, and the spec and the records that they are like."""

    spec: Spec
    records: tuple[Record, ...]
    changes: tuple[Change, ...]


def possible(spec: Spec, records: tuple[Record, ...], problem: Problem) -> Possible:
    """Return the candidates that a spec names, or the usual ones, for the problem that it makes.

    Raises InputError for a record or a setting that is not there.
    """
    every = pool(spec, records)
    return Possible(every.spec, every.records, stated(every.spec, problem))


@dataclasses.dataclass(frozen=True, eq=False)
class Elsewhere:
    """A hypothesis where records are replaced by candidates that change the same settings.

    - `here`: at its fit; `there`: expanded where the candidates stand, with records of their kinds
      alone. - `families`: programs of the records as they are changed.
    """

    here: LocalFit
    there: LocalFit
    families: tuple[Family, ...]

    def tracks(self, like: str) -> tuple[str, ...]:
        """Labels of the tracks of a record: one or both cylinders."""
        return tuple(t.label for t in self.there.layout.problem.tracks if t.name == like)

    def rows(self, like: str) -> Bool[np.ndarray, " n"]:
        """Which samples a candidate would read (n,)."""
        layout = self.there.layout
        mine = [label in self.tracks(like) for label in layout.tracks]
        return np.array(mine)[layout.track] & layout.read

    def slopes(
        self, like: str, count: int
    ) -> tuple[Float[np.ndarray, "more size"], Float[np.ndarray, "more own"]]:
        """Slopes of the readings of so many such records: by shared numbers, by their own anew."""
        slopes = self.there.design[self.rows(like)]
        names, before = (labels_of(one.hypothesis) for one in (self.there, self.here))
        own = self.there.hypothesis.own_of(self.tracks(like))
        own |= ~np.isin(names, before)
        shared = np.where(own, 0.0, slopes)[:, [names.index(name) for name in before]]
        return np.tile(shared, (count, 1)), np.kron(np.eye(count), slopes[:, own])

    def curvature(self, like: str, count: int) -> Float[np.ndarray, " more"]:
        """Information of each of those samples."""
        return np.tile(np.maximum(self.there.terms.curvature[self.rows(like)], 0.0), count)

    def beyond(self, spec: Spec, change: Change) -> Beyond | None:
        """What of a candidate would be beyond its limit."""
        layout, hypothesis = self.there.layout, self.there.hypothesis
        rows = self.rows(change.like)
        read: dict[str, float] = {}
        for number, channel in enumerate(layout.channels):
            mine = self.there.reading[rows & (layout.channel == number)]
            if len(mine):
                most = float(np.abs(mine).max())
                read[channel.quantity] = max(most, read.get(channel.quantity, 0.0))
        values = hypothesis.values(self.there.w)
        own = [(p, values[p.label][0]) for p in hypothesis.parameters if p.record == change.like]
        greatest = with_settings(read, layout.problem, change, own)
        return beyond([greatest], limits_of(spec, change))


def alike(changes: tuple[Change, ...]) -> tuple[tuple[Change, ...], ...]:
    """Candidates that change the same settings by as much, whatever record each is like."""
    lots: dict[tuple[float | str, ...], list[Change]] = {}
    for one in changes:
        ranges = sorted(one.ranges.items())
        settings = (one.preload, one.flow, one.drive, one.duration, one.interval)
        lot = lots.setdefault((*settings, *(x for pair in ranges for x in pair)), [])
        lot.append(one)
    return tuple(tuple(lot) for lot in lots.values())


def elsewhere(
    here: LocalFit, possible: Possible, changes: tuple[Change, ...], program: Family,
    further: tuple[Family, ...] = (),
) -> Elsewhere:  # fmt: skip
    """Expand a hypothesis where candidates stand in place of the records they are like.

    - `changes`: candidates that change the same settings. - `program`: that the hypothesis is
      expanded by. - `further`: programs that are wanted for the changed records, too.
    """
    hypothesis = here.hypothesis
    new = changed(possible.spec, possible.records, hypothesis.problem, changes)
    there = dataclasses.replace(hypothesis, problem=new)
    known = dict(zip(labels_of(hypothesis), here.w, strict=True))
    numbers = moved(hypothesis.parameters, there.parameters, changes, here.w)
    ends = [known.get(name, 0.0) for name in labels_of(there)[len(numbers) :]]
    w = np.concatenate([numbers, ends])
    levels = dict(zip(_levels(hypothesis.problem), here.z_noise, strict=True))
    z_noise = np.array([levels.get(label, 0.0) for label in _levels(new)])
    like = {one.like for one in changes}
    kinds = {track.kind for track in new.tracks if track.name in like}
    point = Point(there, _weighed(new, here.layout), w, z_noise)
    local = expanded(program.over(new, kinds), point)
    return Elsewhere(here, local, tuple(one.over(new, kinds) for one in further))


def _levels(problem: Problem) -> list[str]:
    """Labels of the noise levels."""
    return [p.label for p in problem.parameters.sampled if p.base == "noise"]


def _weighed(problem: Problem, like: Layout) -> Layout:
    """The samples of candidates, each as much of a fact as those of the channel it is like."""
    new = lay_out(problem)
    means = like.mean_weights()
    weight = np.array([means.get((c.track, c.quantity), 1.0) for c in new.channels])
    return new.weighed(np.where(new.read, weight[new.channel], 0.0))
