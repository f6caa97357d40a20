"""The stories of the release and the causes of S p / v in free running, as values."""

from typing import ClassVar

import numpy as np
from jax import Array

from rigid.effects import CATALOGUE
from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import PriorDescription, lognormal, loguniform, parameter, uniform
from rigid.published.quantities import Effects, Response, Values, response, superposed
from rigid.published.story import Cause, Quantity, Story, plain, quantity

AREA = 44.2e-4  # m^2; paper, eq. (1)
ROD_AREA = 3.141592653589793 * 0.05**2 / 4  # m^2; plunger of 5 cm, "Construction"
ANNULUS = AREA - ROD_AREA
OIL = 2e9  # Pa; paper, eq. (1)


class RodSideChamber(AbstractEffect):
    """A second oil spring: F = -k_oil S_rod/L_rod (x_SS), S_rod = 24.6 cm2 of a bore of 44.2 cm2.

    The rig is double-acting, with two hoses for each cylinder; with both valves shut the rod side
    holds oil of its own. It is linear, so that the eigenvalues at rest are all there is to it.
    """

    column: Array = parameter("L_rod", r"L_\mathrm{rod}", "m", lognormal(0.2, 1.5))

    name: ClassVar[str] = "rod-side-chamber"
    equation: ClassVar[str] = "oil-balance"
    source: ClassVar[str] = "paper, Construction: two hoses, plunger of 5 cm; eq. (9) for its oil"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("release",)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force of the oil on the rod side."""
        return Action(between=-OIL * ANNULUS / self.column * state.stroke)


FIXED_ROOT: Effects = tuple(
    CATALOGUE[name] for name in ("load-cell-spring", "oil-compressibility", "viscous-friction")
)
FREE_ROOT: Effects = (*FIXED_ROOT, CATALOGUE["free-root-plate"])
MEMORY: Effects = (*FIXED_ROOT, CATALOGUE["frequency-dependent-friction"])
ROD_SIDE: Effects = (*FIXED_ROOT, RodSideChamber)


def _mu(known: PriorDescription, low: float, high: float) -> Quantity:
    return quantity("mu", r"\mu", "N s/m", known, loguniform(low, high))


def _of_effect(name: str, ranges: tuple[tuple[float, float], ...]) -> tuple[Quantity, ...]:
    """The parameters of an effect: the catalogue's priors, and all orders in `ranges` alike."""
    out, left = [], list(ranges)
    for info in CATALOGUE[name].parameters():
        for label, prior in zip(info.labels, info.priors, strict=True):
            out.append(quantity(label, info.symbol, info.unit, prior, loguniform(*left.pop(0))))
    return tuple(out)


def _constant(values: Values) -> np.ndarray:
    return values["mu"]


def _with_memory(values: Values) -> np.ndarray:
    return values["mu"] + values["mu_branch[1]"] + values["mu_branch[2]"]


def toe(story: Story, values: Values) -> Response:
    """The release with a load-cell end that at 6 kN has another stiffness than at 250 kN."""
    return response(story.effects, {**values, "k_LC": values["k_LC"] * values["toe_ratio"]})


def pitch(story: Story, values: Values) -> Response:
    """Heave and pitch of a plate on two equal cylinders of which one is loaded.

    They do not touch each other. Heave moves half of the plate with each cylinder; in pitch the
    share is (rho/d)^2 of that, rho the radius of gyration and d half the distance of the cylinders.
    Each holds half of the load, so that the lower cylinder begins without pressure. The
    accelerometer sits `pitch_lever` times d above the centre.
    """
    heaved = {**values, "preload": values["preload"] / 2}
    turned = {**heaved, "M_Fl": values["M_Fl"] * values["pitch_ratio"]}
    parts = [response(story.effects, v) for v in (heaved, turned)]
    levers = [np.ones_like(values["mu"]), values["pitch_lever"]]
    return superposed(parts, levers, [(1.0, 1.0), (1.0, -1.0)])


_ANY_MU = _mu(CATALOGUE["viscous-friction"].parameters()[0].priors[0], 1e2, 1e7)
_FREE_RELEASE = "a release with the root plate clamped (or an accelerometer on it)"

STORIES: tuple[Story, ...] = (
    Story(
        "constant", "One constant μ, fixed root", FIXED_ROOT, (_ANY_MU,),
        "eqs. (10)-(13) hold as printed, with one μ of any size",
        "a second accelerometer, on the cylinder: below ε = 1.38 it moves against the plunger, "
        "locked it moves with it",
        plain, _constant,
    ),
    Story(
        "small", "Constant μ, small: about eq. (17)", FIXED_ROOT,
        (_mu(loguniform(1.2e3, 1.1e4), 1e2, 4e4),),  # eq. (17) within a factor of three
        "the root of eq. (14) near that without friction is what Fig. 8 shows",
        "the period itself: 13.6 ms or 10 ms is 22 samples or 16 of Fig. 8",
        plain, _constant,
    ),
    Story(
        "near", "Constant μ near 10⁵", FIXED_ROOT, (_mu(lognormal(1e5, 1.6), 4e4, 4e5),),
        "friction is beyond critical (ε above 1.38); oil may have to bear a bar or two of tension",
        "the oil pressure during the release, sampled at 1 kHz or more",
        plain, _constant,
    ),
    Story(
        "locked", "Plunger locked by friction", FIXED_ROOT,
        (_mu(loguniform(0.9e6, 6.7e6), 4e5, 1e7),),  # from 1/1.5 of mu_A to 1.5 mu_B of eq. (18)
        "the μ of eq. (18) holds in the release as well; something else ends the motion in 40 ms",
        "the stroke sensor during the release: a locked plunger does not move",
        plain, _constant,
    ),
    Story(
        "root", "Root plate free", FREE_ROOT,
        (_ANY_MU, *_of_effect("free-root-plate", ((1e-3, 2e-2),))),
        "the rig hangs: the root plate moves as a free mass, nothing holds it in 40 ms",
        _FREE_RELEASE,
        plain, _constant,
    ),
    Story(
        "pitch", "Plate pitches", FIXED_ROOT,
        (
            _ANY_MU,
            quantity("pitch_ratio", r"(\rho/d)^2", "1", lognormal(0.5, 1.6), loguniform(0.1, 2.0)),
            quantity("pitch_lever", "e/d", "1", uniform(0.5, 2.0), uniform(0.0, 3.0)),
        ),
        "only the top cylinder is loaded, both are alike and shut, and the lower one, out of load, "
        "can pull on its oil",
        "a second accelerometer at the lower end of the plate: in pitch it moves the other way",
        pitch, _constant,
    ),
    Story(
        "memory", "Friction with memory", MEMORY,
        (
            _ANY_MU,
            *_of_effect(
                "frequency-dependent-friction",
                ((1e3, 1e7), (1e3, 1e7), (0.03, 3.0), (1e-4, 3e-2)),
            ),
        ),
        "the seals store energy: friction is a spring at 100 Hz and a dashpot in slow running",
        "releases from the same load at other oil columns: the period follows the column only as "
        "far as the oil is the spring",
        plain, _with_memory,
    ),
    Story(
        "rod", "Rod-side chamber shut in", ROD_SIDE,
        (
            _ANY_MU,
            quantity("L_rod", r"L_\mathrm{rod}", "m", lognormal(0.2, 1.5), loguniform(0.02, 0.37)),
        ),
        "the second hose is shut as well, and its oil is free of air",
        "a release with the rod-side hose open to the tank",
        plain, _constant,
    ),
    Story(
        "toe", "Another k_LC at 6 kN", FIXED_ROOT,
        (
            _ANY_MU,
            quantity(
                "toe_ratio", r"k_6/k_\mathrm{LC}", "1", lognormal(1.0, 2.0), loguniform(0.1, 10.0)
            ),
        ),
        "the 1 mm toe of Fig. 6 is in the load-cell end; its stiffness at 0.1 mm was not measured",
        "releases from 6, 20 and 60 kN: the period settles where the toe ends",
        toe, _constant,
    ),
)  # fmt: skip

_SPEED_TEST = "free runs of one cylinder at two or three settings of its valve: "

CAUSES: tuple[Cause, ...] = (
    Cause(
        "same", "The friction of the release", "", "", "",
        {"catalogue": (1.0, 1.0), "indifferent": (1.0, 1.0)},
        {"catalogue": 1.5, "indifferent": 2.0}, 0, 1.0,
        "what stops the release also carries S p in free running",
        _SPEED_TEST + "S p in proportion to the speed",
    ),
    Cause(
        "slow", "A viscous friction of slow motion alone", "mu_slow", r"\mu_\mathrm{slow}", "N s/m",
        {"catalogue": (1e5, 10.0), "indifferent": (5.7e5, 5.0)},
        {"catalogue": 1.5, "indifferent": 2.0}, 0, 1.0,
        "the paper's own reading: μ depends on the frequency",
        _SPEED_TEST + "S p in proportion to the speed",
    ),
    Cause(
        "coulomb", "Coulomb friction", "F_C", r"F_\mathrm{C}", "N",
        {"catalogue": (500.0, 4.0), "indifferent": (5e3, 5.0)},
        {"catalogue": 1.5, "indifferent": 2.0}, 1, 1.0,
        "a dry friction of 12 kN and more, which then would hold the plunger in the release, too",
        _SPEED_TEST + "S p stays, and turns over when the plunger turns",
    ),
    Cause(
        "return", "Return spring or back pressure of the rod side", "F_return", "F_0", "N",
        {"catalogue": (1e3, 4.0), "indifferent": (5e3, 5.0)},
        {"catalogue": 1.5, "indifferent": 2.0}, 1, 1.0,
        "48 bar on the 24.6 cm² of the rod side of A, or a spring of 12 kN",
        _SPEED_TEST + "S p stays, and stays after the valve is shut",
    ),
    Cause(
        "hose", "Pressure drop between gauge and chamber", "R_hose", r"R_\mathrm{h}", "Pa s/m^3",
        {"catalogue": (5e9, 4.0), "indifferent": (5.7e5 / AREA**2, 5.0)},
        {"catalogue": 2.0, "indifferent": 3.0}, 0, AREA**2,
        "the gauge sits upstream of a hose or of a hand valve that is nearly shut",
        "the pressure just after the valve is shut: a drop along a hose is gone at once",
    ),
)  # fmt: skip

TRANSFER = {"catalogue": 1.5, "indifferent": 2.5}
"""Factor (1 sd) by which kappa in free running differs from that of the field test."""
