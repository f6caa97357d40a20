"""The constants of the rig as printed, and draws of them within their uncertainty."""

from collections.abc import Callable, Mapping

import numpy as np
from jax import Array

from rigid.physics.characteristic import TwoMassRig, frame_stiffness
from rigid.published.walk.numbers import Numbers
from rigid.spec.rig import COLUMN_SHARE, FRAME_SHARE, MASS_SHARE, OIL_SHARE

Constants = Mapping[str, float]
Values = Mapping[str, Array | float]
"""Constants of one rig, and of one or several side by side."""

DRAWS = 400
"""Of the constants: a 5 % quantile is then good for a tenth of the band."""

_NUMBERS = {
    "M_HC": ("cylinder_mass", MASS_SHARE),
    "M_Pl": ("plunger_mass", MASS_SHARE),
    "M_Fl": ("indenter_mass", MASS_SHARE),
    "S_Pl": ("pushing_area", 0.0),
    "k_oil": ("oil_bulk_modulus", OIL_SHARE),
    "L_0": ("oil_column", COLUMN_SHARE),
    "p_max": ("pump_pressure", 0.0),
}
"""Constants by symbol: the printed number, and its relative sd (docs/spec.md)."""

STROKE_READING = 0.1e-3
"""m (1 sd) by which a stroke is read off Fig. 6; fits/paper.toml."""

PRELOAD_SHARE = 0.01
"""Relative sd of the preload of a release; docs/spec.md."""


def section(numbers: Numbers) -> float:
    """S_B of eq. (15) [m^2]."""
    width, height = numbers["beam_width"].si, numbers["beam_height"].si
    return (width + 2 * height) * numbers["beam_thickness"].si


def nominal(numbers: Numbers) -> dict[str, float]:
    """Constants by symbol [SI], as printed; k_frame by eq. (15)."""
    out = {symbol: numbers[name].si for symbol, (name, _) in _NUMBERS.items()}
    frame = frame_stiffness(
        numbers["young_modulus"].si, section(numbers), numbers["frame_length"].si,
        numbers["beams_factor"].si,
    )  # fmt: skip
    return out | {
        "k_LC": numbers["k_LC"].si,
        "k_frame": frame,
        "preload": numbers["preload"].si,
        "frame_stroke": numbers["frame_stroke"].si,
    }


def draws(numbers: Numbers, seed: int, count: int = DRAWS) -> list[dict[str, float]]:
    """Draws of the constants: Gaussian about the print; what is rounded, even within that.

    The stroke of the frame test is rounded to the millimetre and read to 0.1 mm (fits/paper.toml).
    """
    rng = np.random.default_rng([seed, 30])
    centre = nominal(numbers)
    shares = {symbol: share for symbol, (_, share) in _NUMBERS.items()}
    shares |= {"k_frame": FRAME_SHARE, "preload": PRELOAD_SHARE}
    rounded = ("k_LC", "frame_stroke")
    out = []
    for _ in range(count):
        normal = dict(zip(shares, rng.standard_normal(len(shares)), strict=True))
        one = {name: centre[name] * (1.0 + shares[name] * normal[name]) for name in shares}
        for name in rounded:
            one[name] = centre[name] + numbers[name].half_width * rng.uniform(-1.0, 1.0)
        one["frame_stroke"] += STROKE_READING * rng.standard_normal()
        out.append(one)
    return out


def two_masses(values: Constants) -> TwoMassRig:
    """The linear rig of eqs. (10)-(13)."""
    return TwoMassRig(
        values["M_HC"] - values["M_Pl"],
        values["M_Pl"] + values["M_Fl"] / 2,
        values["k_oil"] * values["S_Pl"] / values["L_0"],
        values["k_LC"],
    )


def band(of: Callable[[Constants], float], drawn: list[dict[str, float]]) -> tuple[float, float]:
    """5 and 95 % of a number over draws of the constants."""
    low, high = np.percentile([of(one) for one in drawn], (5, 95))
    return float(low), float(high)
