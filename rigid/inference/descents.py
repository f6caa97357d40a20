"""Descents from many points at once, through easier problems to the one that is asked."""

import dataclasses
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from rigid.inference.newton import Expansion, descend
from rigid.likelihood.problem import Problem

ONE_POINT = 0.1
"""Ends of a coarse descent closer than this, in sds there (root of mean square), are one point: a
descent is left when it promises some 1e-4 nats, which is 0.014 sds in all."""
AGREE = 1.0
"""Two starts that end within this of each other in log-posterior have found the same optimum."""


class End(NamedTuple):
    """Where a descent ended, and how many starts had led to its beginning."""

    w: np.ndarray
    starts: int


Led = list[tuple[End, Expansion]]
"""Where descents ended, and the expansion there."""


@dataclasses.dataclass(frozen=True, eq=False)
class Descents:
    """Descents of one problem; none goes twice from a point.

    - `problem`; `z_noise`: noise levels. - `known`: ends and expansions by where they began.
    """

    problem: Problem
    z_noise: np.ndarray
    known: dict[bytes, tuple[np.ndarray, Expansion]] = dataclasses.field(default_factory=dict)

    def lead(self, ends: list[End], report: Callable[[int], None]) -> Led:
        """Lead points to optima; the first by itself, so that programs are compiled once."""
        led: Led = []

        def run(end: End) -> tuple[End, Expansion]:
            at = end.w.tobytes()
            if at not in self.known:
                self.known[at] = descend(self.problem, end.w, self.z_noise)
            w, there = self.known[at]
            return End(w, end.starts), there

        def add(one: tuple[End, Expansion]) -> None:
            led.append(one)
            report(sum(end.starts for end, _ in led))

        add(run(ends[0]))
        with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
            for one in pool.map(run, ends[1:]):
                add(one)
        return led


def through(
    stages: tuple[Descents, ...], ends: list[End], report: Callable[[int], None] = lambda _: None
) -> Led:
    """Lead points through all stages; those that one of them has led to one point go on as one."""
    starts, led = sum(end.starts for end in ends), []
    for number, stage in enumerate(stages):

        def passed(done: int, before: int = starts * number) -> None:
            report((before + done) // len(stages))

        led = stage.lead(ends, passed)
        ends = _merged(led)
    return led


def agree(led: Led) -> bool:
    """Whether two starts ended in the best optimum."""
    values = np.array([there.value for _, there in led], dtype=float)
    starts = np.array([end.starts for end, _ in led])
    near = values < np.min(values, where=np.isfinite(values), initial=np.inf) + AGREE
    return int(starts[np.isfinite(values) & near].sum()) > 1


def _merged(led: Led) -> list[End]:
    """Return the ends with those that are at one point as one."""
    kept: Led = []
    for end, there in led:
        places = (distance(one.w, end.w, np.asarray(at.information)) for one, at in kept)
        i = next((i for i, far in enumerate(places) if far < ONE_POINT), None)
        if i is None:
            kept.append((end, there))
        else:
            one, first = kept[i]
            kept[i] = End(one.w, one.starts + end.starts), first
    return [end for end, _ in kept]


def distance(a: np.ndarray, b: np.ndarray, known: np.ndarray) -> float:
    """Root mean square over the parameters of b - a in standard deviations at a."""
    return float(np.sqrt((b - a) @ known @ (b - a) / len(a)))
