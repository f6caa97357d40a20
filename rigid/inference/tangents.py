"""Directions along which simulations are differentiated: fewer than there are numbers.

A number of one record's own, a flow fraction or an instant of release, moves nothing of another. So
of each record one such number changes with those of the others, and which reading tells of which
number says where it stands (Curtis, Powell and Reid 1974, J. Inst. Maths Applics 13, 117-119).
"""

from typing import NamedTuple

import numpy as np

from rigid.likelihood.groups import AbstractGroup
from rigid.likelihood.parameters import Parameter
from rigid.likelihood.problem import Problem

WIDE = 8
"""Directions come in multiples of so many: loops over others end in numbers that are worked out one
by one (14 directions of the reference campaign took 10.1 ms a group, 16 took 8.0)."""


class Tangents(NamedTuple):
    """Directions of z for each group of a problem.

    - `along` (groups, directions, size). - `entries`: by group (tracks, directions), the place in
      the list of that number by which a track goes along a direction; the length of the list where
      there is none.
    """

    along: np.ndarray
    entries: tuple[np.ndarray, ...]


def tangents(problem: Problem, listed: np.ndarray) -> Tangents:
    """Lay out the directions of a problem.

    - `listed`: the entries of z by which slopes are asked for.
    """
    numbers = [problem.parameters.sampled[i] for i in listed]
    shown = [_of_group(numbers, group) for group in problem.groups]
    many = WIDE * -(-max(len(own) for tracks in shown for own in tracks) // WIDE)
    along = np.zeros((len(shown), many, problem.parameters.size))
    entries = []
    for group, tracks in zip(along, shown, strict=True):
        for own in tracks:
            group[np.arange(len(own)), listed[own]] = 1.0
        padded = [own + [len(listed)] * (many - len(own)) for own in tracks]
        entries.append(np.array(padded, dtype=int))
    return Tangents(along, tuple(entries))


def _of_group(numbers: list[Parameter], group: AbstractGroup) -> list[list[int]]:
    """By track of a group, the places of the numbers that it depends on, those of all first."""
    kinds = {"", *(t.kind for t in group.tracks)}
    shared = [i for i, p in enumerate(numbers) if not p.record and p.kind in kinds]
    return [shared + [i for i, p in enumerate(numbers) if p.record == t.name] for t in group.tracks]
