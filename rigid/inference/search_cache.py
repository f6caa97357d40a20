"""The outcome of a search on disk, so that a resumed run does not search again."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from rigid.inference.coordinates import Bend, Chart, Sum
from rigid.inference.proposal import MixtureProposal, Mode, ModeWeights
from rigid.inference.scores import weighted
from rigid.inference.search import Found, Optimum
from rigid.io.cache import Shelf
from rigid.likelihood.noise_spectrum import NoiseLaw
from rigid.likelihood.problem import Problem
from rigid.likelihood.set_aside import without

NAME = "search"


class Searched(NamedTuple):
    """A search, coordinates, the law over its modes in these, and how much each mode holds.

    - `overlooked`: share of the posterior that the law overlooks.
    """

    found: Found
    chart: Chart
    law: MixtureProposal
    weights: ModeWeights
    overlooked: float


KINDS = (
    Searched,
    Chart,
    Sum,
    Bend,
    Found,
    Optimum,
    NoiseLaw,
    MixtureProposal,
    Mode,
    ModeWeights,
)


def once(shelf: Shelf, problem: Problem, make: Callable[[], Searched]) -> Searched:
    """Read a search if it was made before, or make it and keep it.

    - `problem`: before the search; that of the result has the weights for the correlation found.
    """
    known = {"problem": problem}
    there = shelf.read(NAME, KINDS, known)
    if there is None:
        made = make()
        shelf.put(NAME, made._replace(found=replace(made.found, problem=problem)), known)
        return made
    plain = without(problem, there.found.aside)
    found = replace(there.found, problem=weighted(plain, there.found.correlation))
    return there._replace(found=found)
