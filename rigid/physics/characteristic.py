"""Closed forms of the paper: the characteristic equation (14) and the estimates (15)-(17).

With friction linear, the oil column frozen at L_0 and no flow, equations (10)-(13) are two masses
and two springs: the cylinder on the load cell, and the plunger on the oil. In the variable
y = omega / omega_0 of a motion exp(i omega t) they have the characteristic equation

    (y^2 - 1)(a1 y^2 - a2) - y^2 = i eps y (y^2 (1 + a1) - a2)                              (14)

so that Im y > 0 decays. Everything is in SI units; nothing here knows of a record or a prior.
The mistakes of the printed equations are derived in docs/errata.md.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float


class TwoMassRig(NamedTuple):
    """The four numbers that the linear rig consists of.

    - `cylinder_mass`: M_HC - M_Pl [kg], eq. (2).
    - `plunger_mass`: M_Pl + M_Fl/2 [kg], eq. (3).
    - `oil_stiffness`: k_oil S_Pl / L_0 [N/m], from eq. (8) and (12).
    - `load_cell_stiffness`: k_LC [N/m], eq. (8).
    """

    cylinder_mass: float
    plunger_mass: float
    oil_stiffness: float
    load_cell_stiffness: float


# Constants of eq. (1), M_Fl from the text below it, L_0 from the text after (14), k_LC after (16).
PUBLISHED_RIG = TwoMassRig(60.0 - 10.0, 10.0 + 200.0 / 2, 2e9 * 44.2e-4 / 0.2, 0.6e8)


class Dimensionless(NamedTuple):
    """The dimensionless numbers of eq. (14), and the frequency [rad/s] that scales y."""

    epsilon: float
    a1: float
    a2: float
    omega_0: float


class Modes(NamedTuple):
    """Motions of the rig, one entry each, slowest oscillation first.

    - `period` [s]: infinite for a motion that does not oscillate.
    - `e_folding` [s]: time in which the amplitude falls by e; infinite without friction.
    """

    period: Float[np.ndarray, " mode"]
    e_folding: Float[np.ndarray, " mode"]


def dimensionless(rig: TwoMassRig, friction: float) -> Dimensionless:
    """Scale the rig to the numbers of eq. (14).

    - `friction`: mu [N s/m], eq. (8).

    Source: definitions below eq. (14).
    """
    omega_0 = np.sqrt(rig.oil_stiffness / rig.plunger_mass)
    return Dimensionless(
        epsilon=friction / (omega_0 * rig.plunger_mass),
        a1=rig.cylinder_mass / rig.plunger_mass,
        a2=rig.load_cell_stiffness / rig.oil_stiffness,
        omega_0=float(omega_0),
    )


def polynomial(epsilon: float, a1: float, a2: float) -> Complex[np.ndarray, "5"]:
    """Coefficients in y of eq. (14) with all terms on the left, highest power first."""
    friction = -1j * epsilon
    return np.array([a1, friction * (1 + a1), -(1 + a1 + a2), -friction * a2, a2], dtype=complex)


def roots(epsilon: float, a1: float, a2: float) -> Complex[np.ndarray, "4"]:
    """Roots y of eq. (14), ordered by real part, then by imaginary part.

    Solved in s = i y, where the coefficients are real: mirror images then are exact, and the real
    part of a motion that does not oscillate is exactly zero.
    """
    growth = np.roots(_real_polynomial(epsilon, a1, a2))
    return np.sort_complex(-1j * growth + 0.0)


def frictionless_roots(a1: float, a2: float) -> tuple[float, float]:
    """The two positive roots y_1 < y_2 of eq. (14) at epsilon = 0, in closed form."""
    half = (1 + a1 + a2) / (2 * a1)
    spread = np.sqrt(half**2 - a2 / a1)
    return float(np.sqrt(half - spread)), float(np.sqrt(half + spread))


def locked_root(a1: float, a2: float) -> float:
    """|y| to which the oscillating roots tend for mu -> infinity.

    Friction then locks plunger and cylinder together: their joint mass swings on the load cell.
    The paper prints the square of this, a2/(1 + a1), after eq. (14).
    """
    return float(np.sqrt(a2 / (1 + a1)))


def critical_epsilon(a1: float, a2: float) -> float:
    """The epsilon from which on one pair of roots of eq. (14) does not oscillate any more.

    Found by bisection on the presence of real roots of the polynomial in s = i y, to the last bit.
    """
    low, high = 0.0, 1.0
    while not _has_real_root(high, a1, a2):
        low, high = high, 2 * high
    while low < (middle := (low + high) / 2) < high:
        low, high = (low, middle) if _has_real_root(middle, a1, a2) else (middle, high)
    return high


def modes(rig: TwoMassRig, friction: float) -> Modes:
    """Periods and e-folding times of the rig with a constant friction coefficient.

    - `friction`: mu [N s/m]. Below the critical epsilon there are two modes, above it one mode and
      two motions that only decay.
    """
    epsilon, a1, a2, omega_0 = dimensionless(rig, friction)
    omega = roots(epsilon, a1, a2) * omega_0
    omega = omega[omega.real >= 0]
    with np.errstate(divide="ignore"):
        period = 2 * np.pi / np.abs(omega.real)
        e_folding = np.where(friction == 0, np.inf, 1 / omega.imag)
    order = np.argsort(np.where(np.isinf(period), -1.0, period))[::-1]
    return Modes(period[order], e_folding[order])


def frame_stiffness(young: float, section: float, length: float, beams: float = 2.0) -> float:
    """Stiffness [N/m] of the calibration frame as one cylinder sees it, eq. (15).

    - `young`: E of steel [Pa]; `section`: S_B of one beam [m^2]; `length`: L_f [m].
    - `beams`: beams per cylinder: 2 as printed, 1 if both cylinders press on the same two.
    """
    return beams * young * section / length


def load_cell_stiffness(load: float, stroke: float, frame: float) -> float:
    """k_LC [N/m] from one point of a frame test, eq. (16).

    - `load`: F_LC [N]; `stroke`: x_SS [m] without the offset of first contact.
    - `frame`: stiffness of the frame [N/m], see `frame_stiffness`.

    Raises ValueError where the frame alone would give way by more than the stroke.
    """
    own_shortening = stroke - load / frame
    if own_shortening <= 0:
        raise ValueError(
            f"a stroke of {stroke} m at {load} N leaves nothing for the load cell: "
            f"a frame of {frame} N/m alone takes {load / frame} m"
        )
    return load / own_shortening


def friction_from_decay(mass: float, angular_frequency: float, periods: float = 3.0) -> float:
    """mu [N s/m] of a single mass whose energy falls by e in a number of periods, eq. (17).

    - `mass` [kg], `angular_frequency` [rad/s] of the undamped oscillator.

    The amplitude of the same mass falls by e in twice as many periods.
    """
    return mass * angular_frequency / (2 * np.pi * periods)


def _real_polynomial(epsilon: float, a1: float, a2: float) -> Float[np.ndarray, "5"]:
    """Eq. (14) in s = i y (a motion exp(s omega_0 t)), highest power first."""
    return np.array([a1, epsilon * (1 + a1), 1 + a1 + a2, epsilon * a2, a2])


def _has_real_root(epsilon: float, a1: float, a2: float) -> bool:
    return bool(np.any(np.roots(_real_polynomial(epsilon, a1, a2)).imag == 0))
