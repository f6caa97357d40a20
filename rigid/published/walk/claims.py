"""What the paper says in numbers, each computed again: eqs. (14) to (18), the text, eq. (22)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigid.effects.pump_curve import LITRE_PER_MINUTE
from rigid.physics import characteristic as ch
from rigid.published.quantities import running_speed
from rigid.published.walk.constants import Constants, band, nominal, two_masses
from rigid.published.walk.items import Explanation, Item
from rigid.published.walk.numbers import Numbers


@dataclass(frozen=True)
class Claim:
    """A printed number that follows from others.

    - `name`: of the number. - `what`: in words. - `computed`: of constants and printed numbers.
    - `half_width`: as `Item`, SI; None: half a unit of the last printed digit.
    """

    name: str
    what: str
    computed: Callable[[Constants, Numbers], float]
    half_width: float | None = None
    bound: str = ""
    explanation: Explanation | None = None
    note: str = ""


def _scaled(c: Constants, friction: float = 0.0) -> ch.Dimensionless:
    return ch.dimensionless(two_masses(c), friction)


def _omega_0(c: Constants, _: Numbers) -> float:
    return _scaled(c).omega_0


def _root(which: int) -> Callable[[Constants, Numbers], float]:
    def computed(c: Constants, _: Numbers) -> float:
        scaled = _scaled(c)
        return ch.frictionless_roots(scaled.a1, scaled.a2)[which]

    return computed


def _period(which: int) -> Callable[[Constants, Numbers], float]:
    return lambda c, _: float(ch.modes(two_masses(c), 0.0).period[which])


def _slow_root(friction: str, part: Callable[[np.ndarray], float]) -> Callable:
    def computed(c: Constants, numbers: Numbers) -> float:
        scaled = _scaled(c, numbers[friction].si)
        return float(part(ch.roots(scaled.epsilon, scaled.a1, scaled.a2)))

    return computed


def _e_folding(friction: str) -> Callable[[Constants, Numbers], float]:
    return lambda c, n: float(ch.modes(two_masses(c), n[friction].si).e_folding[0])


def _limit(c: Constants, _: Numbers) -> float:
    return ch.locked_root(*_scaled(c)[1:3])


def _edge(c: Constants, _: Numbers) -> float:
    return ch.critical_epsilon(*_scaled(c)[1:3])


def _k_lc(c: Constants, n: Numbers) -> float:
    return ch.load_cell_stiffness(n["frame_load"].si, c["frame_stroke"], c["k_frame"])


def _mu(c: Constants, n: Numbers) -> float:
    periods = n["release_divisor"].si / (2 * np.pi)
    return ch.friction_from_decay(two_masses(c).plunger_mass, _omega_0(c, n), periods)


def _swing(c: Constants, n: Numbers) -> float:
    return float(ch.modes(two_masses(c), n["mu_release"].si).period[0])


def _orders(_: Constants, n: Numbers) -> float:
    """The mean number of decades that (18) lies above (17), as a factor."""
    ratios = [n[name].si / n["mu_release"].si for name in ("mu_A", "mu_B")]
    return float(10.0 ** round(np.mean(np.log10(ratios))))


def _least_flow(_: Constants, n: Numbers) -> float:
    return (n["pump_flow_mean"].si - n["pump_flow_half_range"].si) * n["pump_flow_unit"].si


_ROUNDED = "printed to two digits"

CLAIMS: tuple[Claim, ...] = (
    Claim("smallest_flow", "least flow of the pump, from (22) far above p_max", _least_flow,
          explanation=Explanation(
              "pump", "(22) tends to 6.645 − 4.965 = 1.68 l/min; (1) has 1.64 l/min, as the chart "
              "of the pump may have.", 1.64 * LITRE_PER_MINUTE, 1.68 * LITRE_PER_MINUTE,
              1e-3 * LITRE_PER_MINUTE)),
    Claim("fast_stage_load", "load at which the pump changes its stage",
          lambda _, n: n["fast_stage_share"].si * n["largest_load"].si),
    Claim("reference_frequency", "frequency of the plunger on the oil", _omega_0, half_width=5.0,
          note=_ROUNDED),
    Claim("root_1", "slower root of (14) without friction", _root(0)),
    Claim("root_2", "faster root of (14) without friction", _root(1)),
    Claim("period_1", "period of the slower root", _period(0), explanation=Explanation(
        "roots", "Cut off, not rounded: 13.64 ms.", 0.013, 0.01364, 5e-6)),
    Claim("period_2", "period of the faster root", _period(1)),
    Claim("epsilon_real_parts_vanish", "ε from which two roots do not oscillate", _edge,
          explanation=Explanation(
              "roots", "The discriminant of (14) vanishes at ε = 1.384, μ = 9.65·10⁴ N s/m.",
              2.0, 1.3845, 5e-4)),
    Claim("root_limit", "|y| of the swinging roots for ε to infinity", _limit,
          explanation=Explanation(
              "roots", "The limit is √(a2/(1 + a1)) = 0.966; the printed 0.93 is its square, "
              "a2/(1 + a1) = 0.933.", 0.93, 0.966, 5e-4)),
    Claim("k_LC", "stiffness of the load-cell end by (16)", _k_lc,
          note="if the offset of 1 mm is taken off and two beams carry one cylinder"),
    Claim("release_period", "period of the slow mode at the μ of (17)", _swing, half_width=0.5e-3,
          explanation=Explanation(
              "release", "The paper sets the 10 ms beside 2π/ω_0 = 9.91 ms, the plunger on the oil "
              "with the cylinder held; the slow mode of its own model has 13.6 ms.",
              0.010, 0.01364, 1e-5)),
    Claim("release_duration", "time in which the slow mode falls by e at the μ of (17)",
          _e_folding("mu_release"),
          half_width=5e-3, explanation=Explanation(
              "release", "(17) takes a single mass whose energy falls by e in three periods; the "
              "slow mode of the two-mass model falls by e in 235 ms.", 0.040, 0.235, 5e-4)),
    Claim("mu_release", "friction by (17)", _mu,
          note="one mass on the oil whose energy, not amplitude, falls by e in three periods"),
    Claim("mu_orders", "ratio of (18) to (17), in whole orders", _orders,
          note="the two ratios are 365 and 1205"),
    Claim("locked_root_real", "real part of the swinging roots at μ_A",
          _slow_root("mu_A", lambda y: y[-1].real), half_width=0.05, note="'close to'"),
    Claim("locked_root_imaginary_A", "imaginary part of the swinging roots at μ_A",
          _slow_root("mu_A", lambda y: y[-1].imag), explanation=Explanation(
              "roots", "0.01655 with ω_0 as computed; 0.0164 with ω_0 rounded to 630 in ε.",
              0.016, 0.01655, 5e-6)),
    Claim("locked_root_imaginary_B", "imaginary part of the swinging roots at μ_B",
          _slow_root("mu_B", lambda y: y[-1].imag)),
    Claim("fourth_root_above", "fourth root at μ_A",
          _slow_root("mu_A", lambda y: np.imag(y).max()), bound="above",
          note="204.7 at μ_B"),
    Claim("e_folding_A", "time to fall by e at μ_A", _e_folding("mu_A")),
    Claim("e_folding_B", "time to fall by e at μ_B", _e_folding("mu_B")),
)  # fmt: skip
"""In the order of the paper. Numbers of the paper without a claim are taken as given."""

_GIVEN = {
    "mu_A": "from pressures and speeds that are only drawn (Fig. 9): not computed again; see (18)",
    "mu_B": "from pressures and speeds that are only drawn (Fig. 9): not computed again; see (18)",
    "initial_stroke": "compared in (23)",
}


def items(numbers: Numbers, drawn: list[dict[str, float]]) -> list[Item]:
    """Every printed number, in the order of the paper, with what is computed of it."""
    claims = {claim.name: claim for claim in CLAIMS}
    return [
        _claimed(claims[name], numbers, drawn) if name in claims else _given(numbers, name)
        for name in numbers
    ]


def _given(numbers: Numbers, name: str) -> Item:
    number = numbers[name]
    note = ". ".join(part for part in (_GIVEN.get(name, ""), number.note) if part)
    return Item(
        name, number.place, name.replace("_", " "), number.si_unit, number.si, note=note,
        half_width=number.half_width, as_printed=number.as_printed(),
    )  # fmt: skip


def _claimed(claim: Claim, numbers: Numbers, drawn: list[dict[str, float]]) -> Item:
    number = numbers[claim.name]
    half = number.half_width if claim.half_width is None else claim.half_width
    return Item(
        claim.name, number.place, claim.what, number.si_unit, number.si,
        computed=claim.computed(nominal(numbers), numbers),
        band=band(lambda c: claim.computed(c, numbers), drawn),
        half_width=half, bound=claim.bound, explanation=claim.explanation, note=claim.note,
        as_printed=number.as_printed(),
    )  # fmt: skip


def free_run(numbers: Numbers) -> dict[str, tuple[float, float]]:
    """By cylinder: speed [m/s] at the κ of the field test, and pressure [Pa] by (18)."""
    out = {}
    for cylinder in ("A", "B"):
        speed = running_speed(numbers[f"kappa_{cylinder}"].si, numbers["pushing_area"].si)
        friction = numbers[f"mu_{cylinder}"].si
        out[cylinder] = (speed, friction * speed / numbers["pushing_area"].si)
    return out
