"""The errata of the paper in short; in full they stand in docs/errata.md, under these headings."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Erratum:
    """A mistake of the printed paper, or a place where it leaves open what is meant.

    - `key`: of its anchor on the page. - `heading`: in docs/errata.md.
    - `printed`; `should`; `why`.
    - `misprint`: whether the print is wrong, and not only unclear or rounded.
    """

    key: str
    heading: str
    printed: str
    should: str
    why: str
    misprint: bool = True


_LISTED = (
    Erratum(
        "spring", "(19): what the spring acts on",
        "−k_LC (x_HC − x_SS)", "−k_LC (x_Pl − x_SS), that is −k_LC x_HC",
        "From (8) and (10). As printed, a plunger that runs out freely would pull on an idle load "
        "cell.",
    ),
    Erratum(
        "friction-sign", "(20): the sign of friction",
        "+ μ dx_SS/dt on the plunger, as on the cylinder in (19)", "− μ dx_SS/dt",
        "From (3), (8) and (11). As printed, friction pushes both bodies the same way and feeds "
        "energy into the rig, which then is unstable.",
    ),
    Erratum(
        "load-sign", "(20): the sign of the ice load",
        "recorded loads were substituted in (20)", "with a minus sign",
        "Positive is toward the ice, so a compressive load is a negative force on the plate.",
    ),
    Erratum(
        "modulus", "(21): bulk modulus, not density",
        "ρ_oil / (S_Pl x_SS)", "k_oil / (S_Pl L), L = V_oil / S_Pl",
        "From (4), (5) and (9); with ρ_oil the unit of the right-hand side would be kg/(m³ s).",
    ),
    Erratum(
        "two-flows", "(4), (21), (22): one letter, two flows",
        "q in all three", "a mass flow in (4), a volume flow in (21) and (22)",
        "(4) balances kilograms per second; (22) is in litres per minute.",
    ),
    Erratum(
        "column", "(21), (23): the oil column",
        "the stroke x_SS as the length of the oil, 0.2 mm at the start",
        "the oil column, L_0 = 20 cm at zero stroke",
        "A column of 0.2 mm makes the oil 1000 times stiffer than the 20 cm after (14).",
    ),
    Erratum(
        "pump", "(22): the pump",
        "0.05 without a unit; a low flow of 1.68 l/min by (22) and 1.64 l/min by (1)",
        "0.05 per bar",
        "The formula keeps the fast flow up to 700 bar, while the text has the pump change its "
        "stage near 136 bar.", misprint=False,
    ),
    Erratum(
        "undefined", "(19)-(21): a symbol that is not defined",
        "dx_PSS/dt", "dx_SS/dt", "No other quantity of that name appears.",
    ),
    Erratum(
        "roots", "The characteristic equation (14) and its roots",
        "limit a2/(1 + a1) = 0.93; real parts vanish at ε of about 2; T_1 = 0.013 s",
        "limit √(a2/(1 + a1)) = 0.966; ε = 1.384; T_1 = 0.0136 s",
        "The limit is the square of what it should be; the edge is where the discriminant of (14) "
        "vanishes; T_1 is cut off instead of rounded.",
    ),
    Erratum(
        "frame", "(15), (16): k_LC from the frame",
        "k_LC = 0.6·10⁸ N/m", "60.6, 76.9, 80.0 or 111.1 MN/m",
        "The text leaves open whether both cylinders press on the same two beams, and whether the "
        "offset of 1 mm is still inside the 5 mm.", misprint=False,
    ),
    Erratum(
        "release", "(17): friction from the release",
        "10 ms and 40 ms on record, μ = 3.7·10³ N s/m",
        "the model swings in 13.6 ms and falls by e in 235 ms at that μ",
        "(17) is one mass on the oil whose energy falls by e over three periods; no mode of the "
        "paper's own model has a period of 10 ms at this μ.", misprint=False,
    ),
    Erratum(
        "release-rig", "(17): what the release test is",
        "the rig hangs on a frame; 6 kN in the top cylinder",
        "the model has a fixed root and equal loads",
        "The test and the model differ in both.", misprint=False,
    ),
    Erratum(
        "running", "(18): friction in free running",
        "μ_A and μ_B from pressures and speeds that are only drawn", "cannot be computed again",
        "All of the pressure is taken for viscous friction.", misprint=False,
    ),
    Erratum(
        "simulations", "The simulations",
        "the loads differ by less than 0.003 %", "by far more as a largest deviation",
        "One converter step of the load that enters within one sample makes load and ice force "
        "differ by 49 to 101 N.", misprint=False,
    ),
)  # fmt: skip

ERRATA = {one.key: one for one in _LISTED}
