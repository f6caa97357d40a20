import pytest

from rigid.io.errors import InputError
from rigid.records.units import UNITS, contradiction, in_name, known, to_si

PER_UNIT = [
    ("time", "min", 60.0),
    ("load", "kN", 1e3),
    ("load", "lbf", 4.4482216152605),
    ("stroke", "in", 0.0254),
    ("stroke", "um", 1e-6),
    ("pressure", "psi", 6894.757293168),
    ("pressure", "mbar", 100.0),
    ("acceleration", "mg", 9.80665e-3),
    ("acceleration", "m/s2", 1.0),
]


@pytest.mark.parametrize(("quantity", "unit", "factor"), PER_UNIT)
def test_factors(quantity, unit, factor):
    assert to_si(quantity, unit, None, "here") == pytest.approx(factor, rel=1e-12)


def test_counts_take_their_scale():
    assert to_si("acceleration", "counts", -0.06, "here") == -0.06


REFUSED = {
    "unknown": ("load", "ton", None, ("here", "'ton' is not known", "kN, MN, kgf, lbf, counts")),
    "case": ("load", "KN", None, ("'KN' is not known",)),
    "other dimension": ("pressure", "mm", None, ("unit of length", "Pa, kPa, MPa, bar")),
    "g of a mass": ("load", "g", None, ("unit of acceleration",)),
    "counts bare": ("stroke", "counts", None, ("needs a scale in m per count",)),
    "counts by zero": ("stroke", "counts", 0.0, ("needs a scale",)),
    "scale beside a unit": ("load", "kN", 2.0, ("both the unit 'kN' and a scale", "N per number")),
    "no quantity": ("colour", "m", None, ("no quantity", "acceleration")),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(case):
    quantity, unit, scale, says = REFUSED[case]
    with pytest.raises(InputError) as caught:
        to_si(quantity, unit, scale, "here")
    for words in says:
        assert words in str(caught.value)


def test_units_in_a_file():
    assert [known(text) for text in ("kN", " [mm] ", "(sec)", "m/s\u00b2", "\u00b5s")] == [
        *("kN", "mm", "s", "m/s^2", "us")
    ]
    assert [known(text) for text in ("", "degC", "KN", "timestamp", "counts")] == [""] * 5
    assert [in_name(name) for name in ("time [s]", "Load (kN)", "Hum(3)", "N", "a [s] b")] == [
        *("s", "kN", "", "", "")
    ]


def test_contradictions():
    assert "the file gives the unit 'kN', the spec 'N'" in contradiction("kN", "N")
    assert "the file gives the unit 'mm', the spec 'kN'" in contradiction("mm", "kN")
    for stated, unit in [("kN", "kN"), ("m/s2", "m/s^2"), ("", "N"), ("kN", "counts")]:
        assert contradiction(stated, unit) == ""
    assert contradiction("s", "timestamp") == ""


def test_every_unit_is_positive():
    assert all(factor > 0 for _, factor in UNITS.values())
