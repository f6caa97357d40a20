"""Equations (2) to (23) as printed, typeset, and what each symbol is.

They are set as MathML, which browsers set without JavaScript and screen readers read aloud. Parts
are strings of markup. A plain text is taken apart: a number is <mn>, a letter with its index
(`M_HC`, `x_SS`) a variable with an upright index, any other sign an operator.
"""

import re
from dataclasses import dataclass

from markupsafe import Markup, escape

_TOKEN = re.compile(r"([0-9]+(?:\.[0-9]+)?)|([^\W\d_])(?:_([A-Za-z0-9,]+))?|(\S)", re.UNICODE)
_FUNCTIONS = ("tanh",)


def symbol(text: str) -> str:
    """A variable with its index: `k_LC`."""
    base, _, index = text.partition("_")
    letter = f"<mi>{escape(base)}</mi>"
    return (
        f"<msub>{letter}<mi mathvariant='normal'>{escape(index)}</mi></msub>" if index else letter
    )


def words(text: str) -> str:
    """The parts of a plain text, one after another."""
    out = []
    for function in re.split(rf"({'|'.join(_FUNCTIONS)})", text):
        if function in _FUNCTIONS:
            out.append(f"<mi>{function}</mi>")
            continue
        for number, letter, index, sign in _TOKEN.findall(function):
            if number:
                out.append(f"<mn>{number}</mn>")
            elif letter:
                out.append(symbol(f"{letter}_{index}" if index else letter))
            else:
                out.append(f"<mo>{escape(sign)}</mo>")
    return "".join(out)


def _part(part: str) -> str:
    """Markup as it is; a plain text taken apart."""
    return part if part.startswith("<") else words(part)


def row(*parts: str) -> str:
    """Parts in one row."""
    return f"<mrow>{''.join(_part(part) for part in parts)}</mrow>"


def frac(above: str, below: str) -> str:
    """A fraction."""
    return f"<mfrac>{row(above)}{row(below)}</mfrac>"


def power(base: str, exponent: str) -> str:
    """A power."""
    return f"<msup>{row(base)}{row(exponent)}</msup>"


def rate(of: str, order: int = 1) -> str:
    """A derivative by time."""
    if order == 1:
        return frac(row("d", of), "d t")
    return frac(row(power("d", str(order)), of), row("d", power("t", str(order))))


def bracket(*parts: str) -> str:
    """Parts in round brackets."""
    return row("(", *parts, ")")


def equation(*parts: str) -> Markup:
    """A displayed equation."""
    return Markup(f"<math display='block'>{row(*parts)}</math>")


CYLINDER, PLUNGER = "(M_HC − M_Pl)", row("(M_Pl +", frac("M_Fl", "2"), ")")


@dataclass(frozen=True)
class Typeset:
    """An equation of the paper.

    - `number`. - `title`: what it says. - `shown`: as printed, one or more lines.
    - `symbols`: keys of `SYMBOLS` that it brings in.
    """

    number: int
    title: str
    shown: tuple[Markup, ...]
    symbols: tuple[str, ...]


def _definitions() -> Markup:
    return equation(
        "y =", frac("ω", "ω_0"), ", ", power("ω_0", "2"), "=",
        frac("k_oil S_Pl", row("L_0", PLUNGER)),
        ", a_1 =", frac(CYLINDER, PLUNGER), ", a_2 =", frac("k_LC L_0", "k_oil S_Pl"),
        ", ε =", frac("μ", row("ω_0", PLUNGER)),
    )  # fmt: skip


TYPESET: tuple[Typeset, ...] = (
    Typeset(2, "Momentum of the cylinder without the plunger",
            (equation(CYLINDER, rate("v_HC"), "= F_LC − F_p − F_f"),),
            ("M_HC", "M_Pl", "v_HC", "F_LC", "F_p", "F_f")),
    Typeset(3, "Momentum of the plunger with half of the flat indenter",
            (equation(PLUNGER, rate("v_Pl"), "= F_p + F_f + F_Ice"),), ("M_Fl", "v_Pl", "F_Ice")),
    Typeset(4, "Mass of the oil", (equation(rate("(ρ_oil V_oil)"), "= κ q"),),
            ("rho_oil", "V_oil", "kappa", "q")),
    Typeset(5, "Volume of the oil", (equation(rate("V_oil"), "= S_Pl v_SS"),), ("S_Pl", "v_SS")),
    Typeset(6, "Stroke", (equation("x_SS = x_Pl − x_HC"),), ("x_SS", "x_Pl", "x_HC")),
    Typeset(7, "Velocities", (equation(rate("x_HC"), "= v_HC ,", rate("x_Pl"), "= v_Pl"),), ()),
    Typeset(8, "Forces of oil, friction and load-cell end",
            (equation("F_p = S_Pl p_oil , F_f = − μ v_SS , F_LC = − k_LC x_HC"),),
            ("p_oil", "mu", "k_LC")),
    Typeset(9, "Compressibility of the oil",
            (equation(rate("p_oil"), "=", frac("k_oil", "ρ_oil"), rate("ρ_oil")),), ("k_oil",)),
    Typeset(10, "Cylinder, without flow and ice",
            (equation(CYLINDER, rate("x_HC", 2), "= μ v_SS − S_Pl p_oil − k_LC x_HC"),), ()),
    Typeset(11, "Plunger, without flow and ice",
            (equation(PLUNGER, rate("x_Pl", 2), "= S_Pl p_oil − μ v_SS"),), ()),
    Typeset(12, "Oil pressure, without flow",
            (equation(rate("p_oil"), "= −", frac("k_oil", "L_0"), "v_SS"),), ("L_0",)),
    Typeset(13, "Plunger against cylinder",
            (equation(rate("x_Pl"), "−", rate("x_HC"), "= v_SS"),), ()),
    Typeset(14, "Characteristic equation of (10) to (13)",
            (equation("(", power("y", "2"), "− 1 ) ( a_1", power("y", "2"), "− a_2 ) −",
                      power("y", "2"), "= i ε y (", power("y", "2"), "( 1 + a_1 ) − a_2 )"),
             _definitions()), ("y", "omega_0", "a_1", "a_2", "epsilon")),
    Typeset(15, "Frame test: displacement of the plunger",
            (equation(frac("F_LC", "S_B"), "= 2 E", frac("x_Pl", "L_f"), ", S_B = ( b + 2 w ) h"),),
            ("S_B", "E", "L_f", "b", "w", "h")),
    Typeset(16, "Stiffness of the load-cell end",
            (equation("k_LC =", frac("2 E S_B F_LC", "2 E S_B x_SS − L_f F_LC")),), ()),
    Typeset(17, "Friction in the quick release",
            (equation("μ ≈", frac(row(PLUNGER, "ω_0"), "6 π"), "= 3.7 ·", power("10", "3"),
                      "<mtext>N s/m</mtext>"),), ()),
    Typeset(18, "Friction in free running",
            (equation("μ_A = 1.35 ·", power("10", "6"), "<mtext>N s/m</mtext>", ", μ_B = 4.46 ·",
                      power("10", "6"), "<mtext>N s/m</mtext>"),), ()),
    Typeset(19, "Cylinder in the simulations",
            (equation(CYLINDER, frac(row(power("d", "2"), bracket("x_Pl − x_SS")),
                                     row("d", power("t", "2"))),
                      "= − k_LC ( x_HC − x_SS ) − S_Pl p_oil + μ", rate("x_PSS")),), ()),
    Typeset(20, "Plunger in the simulations",
            (equation(PLUNGER, rate("x_Pl", 2), "= S_Pl p_oil + μ", rate("x_PSS"), "+ F_Ice"),),
            ()),
    Typeset(21, "Oil pressure in the simulations",
            (equation(rate("p_oil"), "=", frac("ρ_oil", "S_Pl x_SS"),
                      bracket("κ q − S_Pl", rate("x_PSS"))),), ()),
    Typeset(22, "Flow of the pump",
            (equation("q = q_0 ( 6.645 − 4.965 tanh [ 0.05 ( p_oil − p_max ) ] )"),),
            ("q_0", "p_max")),
    Typeset(23, "Initial conditions of the simulations",
            (equation("x_Pl = x_SS = 0.2", "<mtext> mm</mtext>",
                      ", x_Pl ′ = x_SS ′ = 0 , p_oil = 0 , t = 0"),), ()),
)  # fmt: skip

SYMBOLS: dict[str, tuple[str, str, str, str]] = {
    "M_HC": ("M_{HC}", "mass of the hydraulic cylinder, plunger included", "kg", "cylinder_mass"),
    "M_Pl": ("M_{Pl}", "mass of the plunger with its hinge joint", "kg", "plunger_mass"),
    "M_Fl": ("M_{Fl}", "mass of the flat indenter", "kg", "indenter_mass"),
    "v_HC": ("v_{HC}", "velocity of the cylinder", "m/s", ""),
    "v_Pl": ("v_{Pl}", "velocity of plunger and plate", "m/s", ""),
    "F_LC": ("F_{LC}", "force in the load-cell end", "N", ""),
    "F_p": ("F_p", "force of the oil on the piston", "N", ""),
    "F_f": ("F_f", "friction between cylinder and plunger", "N", ""),
    "F_Ice": ("F_{Ice}", "force of the ice on the plate, negative in compression", "N", ""),
    "rho_oil": (r"\rho_{oil}", "density of the oil", "kg/m^3", "oil_density"),
    "V_oil": ("V_{oil}", "volume of the oil in the cylinder", "m^3", ""),
    "kappa": (r"\kappa", "share of the pump's flow that the valve passes", "1", ""),
    "q": ("q", "flow of the pump", "m^3/s", ""),
    "S_Pl": ("S_{Pl}", "pushing area of the plunger", "m^2", "pushing_area"),
    "v_SS": ("v_{SS}", "velocity of the plunger against the cylinder", "m/s", ""),
    "x_SS": ("x_{SS}", "stroke", "m", ""),
    "x_Pl": ("x_{Pl}", "displacement of the plunger", "m", ""),
    "x_HC": ("x_{HC}", "displacement of the cylinder", "m", ""),
    "p_oil": ("p_{oil}", "oil pressure, gauge", "Pa", ""),
    "mu": (r"\mu", "damping coefficient; the paper: coefficient of friction", "N s/m",
           "mu_release"),
    "k_LC": ("k_{LC}", "stiffness of the load-cell end", "N/m", "k_LC"),
    "k_oil": ("k_{oil}", "bulk modulus of the oil", "Pa", "oil_bulk_modulus"),
    "L_0": ("L_0", "length of the oil column", "m", "oil_column"),
    "y": ("y", "complex frequency over that of the plunger on the oil", "1", ""),
    "omega_0": (r"\omega_0", "frequency of the plunger on the oil", "rad/s",
                "reference_frequency"),
    "a_1": ("a_1", "ratio of the masses", "1", ""),
    "a_2": ("a_2", "ratio of the stiffnesses", "1", ""),
    "epsilon": (r"\varepsilon", "friction, dimensionless", "1", ""),
    "S_B": ("S_B", "cross-section of a beam of the frame", "m^2", ""),
    "E": ("E", "Young's modulus of steel", "Pa", "young_modulus"),
    "L_f": ("L_f", "length of the frame", "m", "frame_length"),
    "b": ("b", "width of a beam", "m", "beam_width"),
    "w": ("w", "height of a beam", "m", "beam_height"),
    "h": ("h", "thickness of a beam", "m", "beam_thickness"),
    "q_0": ("q_0", "unit of flow", "m^3/s", "pump_flow_unit"),
    "p_max": ("p_{max}", "pressure at which the pump changes its stage", "Pa", "pump_pressure"),
}  # fmt: skip
"""By key: TeX, meaning, SI unit, and the printed number that is its value (none: a variable)."""

BELONGS: dict[int, tuple[str, ...]] = {
    14: (
        "reference_frequency", "root_1", "root_2", "period_1", "period_2",
        "epsilon_real_parts_vanish", "root_limit",
    ),
    16: ("k_LC",),
    17: ("mu_release", "release_period", "release_duration"),
    18: (
        "mu_orders", "locked_root_real", "locked_root_imaginary_A", "locked_root_imaginary_B",
        "fourth_root_above", "e_folding_A", "e_folding_B",
    ),
    22: ("smallest_flow",),
}  # fmt: skip
"""Printed numbers that follow from an equation, by its number."""
