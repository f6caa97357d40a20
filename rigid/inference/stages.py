"""Easier problems that lead to the one that is asked: louder noise, beginnings of records."""

import dataclasses

import numpy as np

from rigid.likelihood.problem import Problem

COARSE = (1000.0, 30.0)
"""Times the noise of every channel, in the descents before that of the likelihood itself."""
TELLING = 10.0
"""Squares of readings over that noise, summed, for each uncertain number: where there are fewer,
the records say next to nothing, and all starts end where the prior has them. Of two modes that a
noisy record leaves, one would be lost."""
HORIZONS = (0.0625, 0.125, 0.25, 0.5)
"""Shares of the runs of a machine, from their beginnings, that are fitted before the whole."""


def eased(problem: Problem) -> tuple[Problem, ...]:
    """Return a problem with the noise of every channel COARSE times what it is, then itself.

    Such noise is left out where readings are not TELLING under it.

    What swings through many periods is right at one stiffness and wrong at all others near it, at
    whatever noise. Runs of a machine are therefore fitted from their beginnings on, HORIZONS of
    them, before the whole.
    """
    swings = [track.of.solver == "machine" for group in problem.groups for track in group.tracks]
    if any(swings):
        ways = [(COARSE[-1], HORIZONS[0]), *((1.0, share) for share in HORIZONS)]
    else:
        told, enough = _told(problem), TELLING * problem.parameters.size
        ways = [(times, 1.0) for times in COARSE if told > enough * times**2]
    return *(_easier(problem, *way) for way in ways), problem


def _told(problem: Problem) -> float:
    """Sum of the squares of all readings over what the sheets say of noise and converter."""
    told = 0.0
    for piece in problem.pieces:
        variance = piece.sheet.noise**2 + piece.sheet.step**2 / 12.0
        weight = np.asarray(piece.weight)
        read = np.where(weight > 0.0, np.asarray(piece.data), 0.0)
        told += float(np.sum(weight * read**2)) / variance
    return told


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
