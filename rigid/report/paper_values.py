"""Values that the paper publishes for quantities a fit reports, each with its place there."""

import math
from typing import NamedTuple

import numpy as np

from rigid.likelihood.problem import Problem


class Published(NamedTuple):
    """A printed value in SI and its place in the paper."""

    value: float
    place: str


BY_LABEL: dict[str, tuple[Published, ...]] = {
    "k_LC": (Published(0.6e8, "paper, after eq. (16)"),),
    "M_HC": (Published(60.0, "paper, eq. (1)"),),
    "M_Pl": (Published(10.0, "paper, eq. (1)"),),
    "M_Fl": (Published(200.0, "paper, after eq. (1)"),),
    "k_oil": (Published(2e9, "paper, eq. (1)"),),
    "L_0": (Published(0.20, "paper, after eq. (14)"),),
}


CONSTANTS = ("M_HC", "M_Pl", "M_Fl", "k_oil", "L_0")
"""Constants that make a rig the paper's, where they are centred on what it prints."""


def of_the_paper(problem: Problem) -> bool:
    """Whether records are of the rig of the paper: of this machine, and with its constants."""
    listed = (*problem.parameters.sampled, *problem.parameters.known)
    centres = {
        p.base: float(np.ravel(p.prior.from_standard(np.zeros(1)))[0])
        for p in listed
        if p.base in CONSTANTS
    }
    return problem.of_the_rig and all(
        math.isclose(value, BY_LABEL[base][0].value, rel_tol=1e-6)
        for base, value in centres.items()
    )


def published(label: str, ours: bool) -> tuple[Published, ...]:
    """What the paper says of a parameter by its base name.

    - `ours`: whether the rig is that of the paper; of others it says nothing.
    """
    return BY_LABEL.get(label, ()) if ours else ()


def printed(label: str, ours: bool = True) -> float | None:
    """The first value that the paper prints of a parameter, as the tables have it."""
    found = published(label, ours)
    return found[0].value if found else None


def published_frictions(ours: bool) -> tuple[tuple[float | None, Published], ...]:
    """What the paper says of mu, with frequencies."""
    return FRICTION if ours else ()


FRICTION = (
    (100.0, Published(3.7e3, "paper, eq. (17), quick release")),
    (None, Published(1.35e6, "paper, eq. (18), cylinder A, free running")),
    (None, Published(4.46e6, "paper, eq. (18), cylinder B, free running")),
)
"""mu [N s/m] with the frequency [Hz] it was found at; None: steady running."""

KAPPA = (
    Published(0.2, "paper, before eq. (23), cylinder A, field test"),
    Published(0.12, "paper, before eq. (23), cylinder B, field test"),
)
