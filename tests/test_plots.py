"""Figures: labelled, stamped, decimated without loss, the same bytes every time; numbers."""

import dataclasses
import re

import fake_calibration as fake
import numpy as np
import pytest

from rigid.plots import metrology
from rigid.plots.decimate import COLUMNS, band_points, line_points
from rigid.plots.figure import Drawn
from rigid.plots.style import STAMP, tex
from rigid.plots.vector import svg
from rigid.report.calibration import figures
from rigid.report.calibration.figures.friction import friction_figure
from rigid.report.gallery import as_csv, modules

MODULES = {module.__name__.rsplit(".", 1)[-1]: module for module in modules(figures)}
FIGURES = (*MODULES, "release")


def made(name: str, simulated: bool) -> Drawn:
    """The first figure of a file; of a release, which has short records, as well."""
    fits = fake.fits()[-1:] if name == "release" else fake.fits()[:3]
    content = fake.calibration(simulated=simulated, fits=fits, traces=fake.calibration().traces[:1])
    return next(MODULES["records" if name == "release" else name].drawn(content))


NBSP = "\N{NO-BREAK SPACE}"
ABSENT = "\N{EN DASH}"


def typed(text):
    """As it would be typed: what the tests compare with."""
    for sign, key in ((NBSP, " "), ("\N{MINUS SIGN}", "-"), ("\N{MULTIPLICATION SIGN}", "x")):
        text = text.replace(sign, key)
    return text


@pytest.mark.parametrize("name", FIGURES)
def test_axes_that_show_numbers_name_their_unit(name):
    labels = [
        label
        for axes in made(name, False).figure.axes
        for label in (axes.get_xlabel(), axes.get_ylabel())
        if label and axes.axison
    ]
    assert len(labels) >= 2
    assert all(re.search(r"\[[^\]]+\]$", label) for label in labels), labels


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize("simulated", [True, False])
def test_stamp_is_there_exactly_where_data_are_simulated(name, simulated):
    figure = made(name, simulated).figure
    assert any(text.get_text() == STAMP for text in figure.texts) == simulated
    assert (STAMP in svg(figure, "a")) == simulated


@pytest.mark.parametrize("name", FIGURES)
def test_svg_is_the_same_bytes_every_time_and_fetches_nothing(name):
    once, again = (svg(made(name, True).figure, "fig-a") for _ in range(2))
    assert once == again
    assert once.startswith("<svg ")
    assert once.endswith("</svg>")
    assert "<style" not in once
    assert not re.search(r'(?:href|src)="(?!#)', once)


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_says_what_it_is_and_has_its_numbers(name):
    drawn = made(name, False)
    assert re.fullmatch(r"[A-Za-z0-9-]+", drawn.name)
    assert len(drawn.caption) > 40
    assert len(drawn.alt) > 20
    assert "simulated" not in (drawn.caption + drawn.alt).lower()
    rows = as_csv(drawn.numbers).splitlines()
    assert len(rows) > 1
    assert len(rows[0].split(",")) >= 2
    assert any(np.issubdtype(np.asarray(c).dtype, np.number) for c in drawn.numbers.values())


def test_columns_of_numbers_may_differ_in_length_and_hold_words():
    columns = {"a [s]": np.array([1.0, np.nan, 1 / 3]), "b": np.array(["x, y"]), "c": [True, False]}
    assert as_csv(columns) == 'a [s],b,c\n1,"x, y",1\n,,0\n0.333333,,\n'


def test_two_figures_in_a_page_share_no_id():
    def ids(key):
        text = svg(made("friction", True).figure, key)
        defined = re.findall(r'\bid="([^"]+)"', text)
        used = re.findall(r'(?:url\(#|href="#)([^)"]+)', text)
        assert len(defined) == len(set(defined))
        assert set(used) == set(defined)
        return set(defined)

    assert ids("fig-a").isdisjoint(ids("fig-b"))


def test_drawing_leaves_the_global_style_alone():
    import matplotlib

    before = dict(matplotlib.rcParams)
    svg(made("release", True).figure, "a")
    assert dict(matplotlib.rcParams) == before


def test_decimation_keeps_every_extreme_and_its_order():
    values = np.random.default_rng(1).standard_normal(50_000)
    values[12_345], values[33_333], values[7] = 50.0, -60.0, np.nan
    kept = line_points(values)
    assert kept.size <= 4 * COLUMNS
    assert np.all(np.diff(kept) > 0)
    assert {0, 12_345, 33_333, values.size - 1} <= set(kept.tolist())


def test_decimated_band_covers_the_band():
    time = np.linspace(0, 1, 20_000)
    middle = np.sin(300 * time)
    low, high = middle - 0.1, middle + 0.2
    t, lower, upper = band_points(time, low, high)
    starts = np.searchsorted(t, time, side="right") - 1
    assert t.size < 1000
    assert np.all(lower[starts] <= low)
    assert np.all(upper[starts] >= high)


def test_wrong_shapes_are_refused_by_name():
    good = fake.fits()[0]
    with pytest.raises(TypeError, match="data"):
        type(good)(**(vars(good) | {"data": good.data[:-1]}))


def test_a_symbol_that_cannot_be_set_is_shown_as_text():
    assert tex(r"\mu") == r"$\mu$"
    assert tex(r"\nosuch{x") == r"\nosuch{x"


@pytest.mark.parametrize(
    ("value", "sd", "unit", "expected"),
    [
        (6.03e7, 1.2e6, "N/m", "60.3 ± 1.2 MN/m"),
        (6.0312e7, 9.96e5, "N/m", "60.3 ± 1.0 MN/m"),
        (3.61e3, 290.0, "N s/m", "3.61 ± 0.29 kN·s/m"),
        (999.96e3, 120.0, "Pa", "999.96 ± 0.12 kPa"),
        (0.2004, 0.0027, "-", "0.2004 ± 0.0027"),
        (1234.0, 117.0, "kg", "1230 ± 120 kg"),
        (-1.5e-4, 2e-5, "m", "-150 ± 20 µm"),
        (0.35, 0.012, "m/s^2", "0.350 ± 0.012 m/s²"),
        (2.5e-9, 1e-10, "m^3/s", "(2.50 ± 0.10) x 10⁻⁹ m³/s"),
        (0.0, 3.0, "N", "0.0 ± 3.0 N"),
        (-0.001, 3.0, "N", "0.0 ± 3.0 N"),
        (5.0, 0.0, "N", "5 N"),
        (float("nan"), 1.0, "N", ABSENT),
        (None, None, "N", ABSENT),
    ],
)
def test_estimates_have_two_digits_of_uncertainty(value, sd, unit, expected):
    assert typed(metrology.estimate(value, sd, unit)) == expected


@pytest.mark.parametrize(
    ("value", "sd", "unit", "expected"),
    [
        (2.8549e8, 8.4e6, "N/m", "285.5 MN/m"),
        (-5.654e-5, 8.9e-4, "1", "-0.6 x 10⁻⁴"),
        (0.01133, 0.0082, "1", "0.0113"),
        (5.0, 0.0, "N", "5 N"),
        (None, 1.0, "N", ABSENT),
    ],
)
def test_a_number_beside_its_uncertainty_ends_where_that_does(value, sd, unit, expected):
    assert typed(metrology.rounded(value, sd, unit)) == expected


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (1.016673, 1.016699, 7),  # an instant of a release: five digits would show no interval
        (4.8989e7, 4.9862e7, 5),
        (-0.092334, -0.09134, 5),
        (1.0, 1.0 + 1e-12, 8),
        (0.0, 0.0, 5),
        (float("nan"), 1.0, 5),
    ],
)
def test_a_table_tells_the_ends_of_an_interval_apart(low, high, expected):
    assert metrology.digits_apart(low, high) == expected


@pytest.mark.parametrize(
    ("value", "unit", "wanted", "expected"),
    [
        (1003.2, "N", 2, "1.0 kN"),
        (999.6, "N", 2, "1.0 kN"),
        (-0.03, "", 2, "-0.030"),
        (2.05e9, "Pa", 4, "2.050 GPa"),
        (260e3, "N/m", 2, "260 kN/m"),
        (0.0, "N", 2, "0 N"),
        (None, "N", 2, ABSENT),
    ],
)
def test_zeros_that_count_are_shown(value, unit, wanted, expected):
    assert typed(metrology.digits(value, unit, wanted)) == expected


@pytest.mark.parametrize(
    ("low", "high", "unit", "expected"),
    [
        (5.83e7, 6.22e7, "N/m", "58.3 to 62.2 MN/m"),
        (1.2e3, 4e8, "N s/m", "1.2 x 10³ to 4.0 x 10⁸ N·s/m"),
        (-2.0, 3.0, "N", "-2.0 to 3.0 N"),
        (2.0, 2.0, "N", "2 N"),
        (0.196, 0.205, "-", "0.1960 to 0.2050"),
        (1.0, float("inf"), "N", ABSENT),
    ],
)
def test_intervals(low, high, unit, expected):
    assert typed(metrology.interval(low, high, unit)) == expected


def test_minus_is_a_minus_and_a_number_stays_with_its_unit():
    assert metrology.exact(-2.0, "N") == f"\N{MINUS SIGN}2{NBSP}N"


def test_median_has_the_digits_of_its_interval():
    values = (5.83e7, 6.03e7, 6.22e7)
    assert metrology.median(values, "N/m") == f"60.3{NBSP}MN/m"
    assert metrology.median_and_interval(values, "N/m") == f"60.3 (58.3 to 62.2){NBSP}MN/m"


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [(1.35e6, "N s/m", "1.35 MN·s/m"), (6e7, "N/m", "60 MN/m"), (0.2, "-", "0.2")],
)
def test_published_numbers_keep_the_digits_they_came_with(value, unit, expected):
    assert typed(metrology.exact(value, unit)) == expected


def test_an_axis_of_kilograms_takes_no_prefix():
    assert metrology.axis(np.array([60.0, np.nan]), "kg") == (1.0, "kg")
    factor, unit = metrology.axis(np.array([0.0, -2.4e5]), "N")
    assert (factor, unit) == (pytest.approx(1e-3, rel=1e-15), "kN")


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [(0.1, "0.1 s"), (42.4, "42 s"), (59.7, "1 min 0 s"), (61, "1 min 1 s"), (4350, "1 h 12 min")],
)
def test_durations(seconds, expected):
    assert typed(metrology.duration(seconds)) == expected


@pytest.mark.parametrize("parts", [("storage",), ("storage", "dissipative", "magnitude")])
def test_a_part_that_a_law_has_not_is_said_to_be_none(parts):
    """A constant coefficient stores nothing, dry friction alone has no coefficient at all."""
    curve = fake.friction()
    nothing = {part: np.zeros_like(curve.storage) for part in parts}
    text = svg(friction_figure(dataclasses.replace(curve, **nothing), True), "a")
    assert text.count("none under this law") == len(parts)
