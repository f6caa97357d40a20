"""data/paper/published.toml: every entry has its place, and its SI value follows from the print."""

import math
import re
import tomllib
from pathlib import Path

import pytest

PUBLISHED = tomllib.loads(
    (Path(__file__).parents[1] / "data" / "paper" / "published.toml").read_text("utf-8")
)

# Printed unit -> (factor, SI unit). psi: 0.45359237 kg * 9.80665 m/s^2 on (0.0254 m)^2.
PSI = 0.45359237 * 9.80665 / 0.0254**2
UNITS = {
    "1": (1.0, "1"),
    "%": (1e-2, "1"),
    "pi": (math.pi, "1"),
    "kg": (1.0, "kg"),
    "kg/m^3": (1.0, "kg/m^3"),
    "m": (1.0, "m"),
    "cm": (1e-2, "m"),
    "mm": (1e-3, "m"),
    "m^2": (1.0, "m^2"),
    "cm^2": (1e-4, "m^2"),
    "m/s": (1.0, "m/s"),
    "N": (1.0, "N"),
    "kN": (1e3, "N"),
    "N/m": (1.0, "N/m"),
    "N s/m": (1.0, "N s/m"),
    "Pa": (1.0, "Pa"),
    "MPa": (1e6, "Pa"),
    "GPa": (1e9, "Pa"),
    "bar": (1e5, "Pa"),
    "psi": (PSI, "Pa"),
    "1/bar": (1e-5, "1/Pa"),
    "s": (1.0, "s"),
    "ms": (1e-3, "s"),
    "Hz": (1.0, "Hz"),
    "kHz": (1e3, "Hz"),
    "rad/s": (1.0, "rad/s"),
    "l/min": (1e-3 / 60, "m^3/s"),
    "g": (9.80665, "m/s^2"),
    "V": (1.0, "V"),
}
PLACE = re.compile(
    r"(eq\. \(\d+\)|fig\. \d+|section (Construction|Mathematical model|"
    r"Calibration experiments|Numerical simulations))"
)


@pytest.mark.parametrize("name", PUBLISHED)
def test_si_value_follows_from_print(name: str):
    entry = PUBLISHED[name]
    if entry["unit"] == "decades":
        factor, si_unit, printed = 1.0, "1", 10.0 ** entry["value"]
    else:
        (factor, si_unit), printed = UNITS[entry["unit"]], entry["value"]
    assert entry["si_unit"] == si_unit
    assert entry["si"] == pytest.approx(printed * factor, rel=1e-12, abs=0)


@pytest.mark.parametrize("name", PUBLISHED)
def test_entry_is_complete_and_has_a_place(name: str):
    entry = PUBLISHED[name]
    assert set(entry) - {"note"} == {"symbol", "value", "unit", "si", "si_unit", "place"}
    assert PLACE.search(entry["place"]), f"{name}: no place in the paper in {entry['place']!r}"


def test_what_a_calibration_is_compared_with_is_there():
    assert {"k_LC", "mu_release", "mu_A", "mu_B", "kappa_A", "kappa_B"} <= set(PUBLISHED)
