"""Fig. 4: roots of equation (14) in the complex plane."""

from collections.abc import Iterator

import numpy as np

from rigid.physics.characteristic import TwoMassRig, critical_epsilon, dimensionless, roots
from rigid.plots.figure import Drawn
from rigid.plots.shown import Roots
from rigid.published.walk.constants import nominal, two_masses
from rigid.report.calibration.figures.roots import numbers, roots_figure
from rigid.report.paper.content import PaperContent

PLACE = "figure-4"
STEPS = 1200
EDGE = np.linspace(-0.3, 0.3, 121)
"""Roots of the distances in ε from where two roots meet: the paths turn sharply there."""

CLOUD = 100
"""Draws of the constants that are shown."""


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """The figure."""
    shown = _shown(content)
    yield Drawn(
        "figure-4",
        roots_figure(shown, simulated=False),
        "Fig. 4 of the paper, computed: roots of equation (14) while ε grows from 0 to 2.15 "
        "(grey), without friction (circles), and at the friction of (17) and (18). Dots: the roots"
        " at the friction of (17) for constants within their stated uncertainty. The fourth root "
        "at (18) lies above 50, outside.",
        "Roots of the characteristic equation in the complex plane",
        numbers(shown),
    )


def _shown(content: PaperContent) -> Roots:
    walk = content.walk
    rig = two_masses(nominal(walk.numbers))
    most = walk.numbers["epsilon_plotted"].si
    scaled = dimensionless(rig, 0.0)
    edge = critical_epsilon(scaled.a1, scaled.a2)
    near = edge + np.sign(EDGE) * EDGE**2
    steps = np.unique([*np.linspace(0.0, most, STEPS), *near])
    paths = [roots(e, scaled.a1, scaled.a2) for e in steps]
    marks = tuple(
        (label, _at(rig, walk.numbers[name].si))
        for label, name in (
            ("μ of (17), 3.7 kN·s/m", "mu_release"),
            ("μ of (18), A", "mu_A"),
            ("μ of (18), B", "mu_B"),
        )
    )
    friction = walk.numbers["mu_release"].si
    cloud = [_at(two_masses(one), friction) for one in walk.drawn[:CLOUD]]
    label = "μ of (17), constants uncertain"
    return Roots(
        np.stack(paths, 1), (0.0, most), _at(rig, 0.0), marks, (label, np.concatenate(cloud))
    )


def _at(rig: TwoMassRig, friction: float) -> np.ndarray:
    scaled = dimensionless(rig, friction)
    return roots(scaled.epsilon, scaled.a1, scaled.a2)
