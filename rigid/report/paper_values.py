"""Values that the paper publishes for quantities a fit reports, each with its place there."""

from typing import NamedTuple


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


def published(label: str, of_the_rig: bool) -> tuple[Published, ...]:
    """What the paper says of a parameter by its base name; nothing of other machines."""
    return BY_LABEL.get(label, ()) if of_the_rig else ()


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
