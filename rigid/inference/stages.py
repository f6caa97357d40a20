"""Easier problems that lead to the one that is asked: louder noise, beginnings of records."""

import dataclasses

import numpy as np

from rigid.likelihood.problem import Problem

COARSE = (1000.0, 30.0)
"""Times the noise of every channel, in the descents before that of the likelihood itself."""
HORIZONS = (0.0625, 0.125, 0.25, 0.5)
"""Shares of the runs of a machine, from their beginnings, that are fitted before the whole."""


def eased(problem: Problem) -> tuple[Problem, ...]:
    """Return a problem with the noise of every channel COARSE times what it is, then itself.

    What swings through many periods is right at one stiffness and wrong at all others near it, at
    whatever noise. Runs of a machine are therefore fitted from their beginnings on, HORIZONS of
    them, before the whole.
    """
    swings = [track.of.solver == "machine" for group in problem.groups for track in group.tracks]
    ways = [(times, 1.0) for times in COARSE]
    if any(swings):
        ways = [(COARSE[-1], HORIZONS[0]), *((1.0, share) for share in HORIZONS)]
    return *(_easier(problem, *way) for way in ways), problem


def _easier(problem: Problem, times: float, share: float) -> Problem:
    """Return a problem with louder noise, and only the beginnings of the records of a machine."""
    weights = {}
    for piece in problem.pieces:
        tracks = problem.groups[piece.group].tracks
        weight = np.array(piece.weight) / times**2
        for column, number in enumerate(piece.tracks):
            if tracks[number].of.solver == "machine":
                weight[int(np.ceil(share * int(tracks[number].samples))) :, column] = 0.0
        weights[piece.group, piece.quantity] = weight
    groups = tuple(group.beginning(share) for group in problem.groups)
    return dataclasses.replace(problem, groups=groups).with_weights(weights)
