"""The paper computed again: every number and equation is there, and a broken one is told."""

import dataclasses
import re
import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from rigid.published.walk import claims, equations
from rigid.published.walk.constants import draws, nominal
from rigid.published.walk.errata import ERRATA
from rigid.published.walk.histories import SHARES, ice_load
from rigid.published.walk.items import (
    COMPUTED,
    DIFFERS,
    GIVEN,
    MISPRINT,
    REPRODUCED,
    Explanation,
    Item,
)
from rigid.published.walk.numbers import read_numbers
from rigid.published.walk.solving import Stretch, run
from rigid.report.paper.content import PARTS, row
from rigid.report.paper.typeset import BELONGS, SYMBOLS, TYPESET, equation, words

ROOT = Path(__file__).parents[1]
PUBLISHED = tomllib.loads((ROOT / "data" / "paper" / "published.toml").read_text("utf-8"))
NUMBERS = read_numbers()
FEW = draws(NUMBERS, 1, 40)


@pytest.fixture(scope="module")
def numbered():
    return {item.name: item for item in claims.items(NUMBERS, FEW)}


@pytest.fixture(scope="module")
def equalled():
    return {item.name: item for item in equations.items(NUMBERS)}


def test_every_printed_number_is_an_item_with_its_value_and_place(numbered):
    assert list(numbered) == list(PUBLISHED)
    for name, entry in PUBLISHED.items():
        assert numbered[name].printed == entry["si"]
        assert numbered[name].place == entry["place"]
        assert numbered[name].as_printed.split(" ")[0] == NUMBERS[name].text
        assert float(NUMBERS[name].text) == entry["value"]


def test_every_equation_is_compared_and_typeset(equalled):
    assert list(equalled) == [f"equation-{number}" for number in range(2, 24)]
    assert [one.number for one in TYPESET] == list(range(2, 24))
    on_the_page = [number for _, _, shown, _, _ in PARTS for number in shown]
    assert on_the_page == list(range(2, 24))
    assert [n for _, _, _, figures, _ in PARTS for n in figures] == [3, 4, 6, 8, 9, 10, 11, 12]


def test_symbols_and_numbers_that_the_page_names_exist(numbered):
    assert {key for one in TYPESET for key in one.symbols} == set(SYMBOLS)
    for _, _, unit, name in SYMBOLS.values():
        assert not name or NUMBERS[name].si_unit == unit
    for names in BELONGS.values():
        assert all(numbered[name].computed is not None for name in names)


def test_what_can_be_computed_is_reproduced_or_explained(numbered, equalled):
    for item in (*numbered.values(), *equalled.values()):
        assert item.explained, item
    found = {i.name for i in numbered.values() if i.verdict in (MISPRINT, DIFFERS)}
    # Those of docs/errata.md, and no other.
    assert found == {
        "smallest_flow", "period_1", "epsilon_real_parts_vanish", "root_limit", "release_period",
        "release_duration", "locked_root_imaginary_A",
    }  # fmt: skip
    wrong = {i.name for i in equalled.values() if i.verdict != REPRODUCED}
    assert wrong == {f"equation-{number}" for number in (19, 20, 21, 23)}


@pytest.mark.parametrize("name", [claim.name for claim in claims.CLAIMS])
def test_a_number_broken_on_purpose_differs_without_a_reason(name: str):
    number = NUMBERS[name]
    lower = next(c.bound for c in claims.CLAIMS if c.name == name) == "above"
    broken = NUMBERS | {name: number.misprinted(number.si * (2.0 if lower else 1.6))}
    found = {item.name: item for item in claims.items(broken, FEW[:3])}
    assert found[name].verdict == DIFFERS
    assert not found[name].explained
    assert "no reason" in found[name].reason


def test_a_constant_broken_on_purpose_shows_in_what_follows_from_it():
    broken = NUMBERS | {"oil_bulk_modulus": NUMBERS["oil_bulk_modulus"].misprinted(3e9)}
    found = {item.name: item for item in claims.items(broken, FEW[:3])}
    assert found["reference_frequency"].verdict == DIFFERS
    assert not found["root_1"].explained
    # An explanation holds for the two numbers it was made for, and not for others.
    assert not found["root_limit"].explained


@pytest.mark.parametrize("number", [one.number for one in equations.EQUATIONS])
def test_an_equation_broken_on_purpose_differs(number: int):
    one = next(e for e in equations.EQUATIONS if e.number == number)
    here = equations.place(NUMBERS)
    broken = dataclasses.replace(one, printed=lambda p: 1.001 * one.printed(p))
    if one.corrected is not None:
        right = one.corrected
        broken = dataclasses.replace(broken, corrected=lambda p: 1.001 * right(p))
    item = equations._item(broken, here)
    assert item.verdict == DIFFERS
    assert not item.explained


def test_corrected_equations_give_what_the_package_computes():
    here = equations.place(NUMBERS)
    for one in equations.EQUATIONS:
        if one.corrected is not None:
            assert one.corrected(here) == pytest.approx(one.ours(here), rel=1e-12)
            assert abs(one.printed(here) / one.ours(here) - 1.0) > 0.01


def test_no_term_vanishes_at_the_state_of_comparison():
    here = equations.place(NUMBERS)
    terms = (*here.forces, here.slip, here.flow(equations.STATE[4]), *equations.STATE, *here.rates)
    assert all(abs(term) > 0.0 for term in terms)
    # Friction is the smallest force of all; 2 m of relative rounding does not hide it.
    assert abs(here.forces[1]) / max(map(abs, here.forces)) > 1e-4


def test_verdicts():
    why = Explanation("roots", "says", 2.0, 1.0, 0.01)
    assert Item("a", "p", "w", "1", 2.0).verdict == GIVEN
    assert Item("a", "p", "w", "1", None, 1.0).verdict == COMPUTED
    assert Item("a", "p", "w", "1", 2.0, 2.04, half_width=0.05).verdict == REPRODUCED
    assert Item("a", "p", "w", "1", 2.0, 1.0, explanation=why).verdict == MISPRINT
    assert Item("a", "p", "w", "1", 2.0, 1.02, explanation=why).verdict == DIFFERS
    assert Item("a", "p", "w", "1", 2.1, 1.0, explanation=why).verdict == DIFFERS
    assert Item("a", "p", "w", "1", 2.0, 2.5, bound="above").verdict == REPRODUCED
    assert Item("a", "p", "w", "1", 2.0, 2.5, bound="below").verdict == DIFFERS


def test_half_of_what_is_rounded_to_the_print():
    assert NUMBERS["k_LC"].half_width == pytest.approx(0.05e8)
    assert NUMBERS["root_1"].half_width == pytest.approx(0.005)
    assert NUMBERS["frame_stroke"].half_width == pytest.approx(0.5e-3)
    assert NUMBERS["mu_release"].half_width == pytest.approx(50.0)
    assert NUMBERS["e_folding_A"].half_width == pytest.approx(0.05)


def test_errata_stand_in_the_document_under_their_headings():
    headings = re.findall(r"^#+ (.*)$", (ROOT / "docs" / "errata.md").read_text("utf-8"), re.M)
    assert {one.heading for one in ERRATA.values()} <= set(headings)
    used = {c.explanation.erratum for c in claims.CLAIMS if c.explanation}
    used |= {e.erratum for e in equations.EQUATIONS if e.erratum}
    assert used <= set(ERRATA)


def test_bands_hold_the_computed_value_and_their_share(numbered):
    for item in numbered.values():
        if item.band is not None and item.band[1] > item.band[0]:
            low, high = item.band
            assert low < item.computed < high
    # omega_0 goes with the square root of k_oil S / L_0 / m2: sd of half of 5, 2 and 3 (100/110) %.
    share = 0.5 * np.sqrt(0.05**2 + 0.02**2 + (0.03 * 100 / 110) ** 2 + (0.03 * 10 / 110) ** 2)
    many = draws(NUMBERS, 2, 400)
    item = next(i for i in claims.items(NUMBERS, many) if i.name == "reference_frequency")
    assert item.band is not None
    width = (item.band[1] - item.band[0]) / item.computed
    assert width == pytest.approx(2 * 1.645 * share, rel=0.15)  # 400 draws: 7 % (1 sd) of it


def test_rows_are_in_the_unit_of_the_print(numbered):
    assert row(numbered["smallest_flow"]).computed == "1.68\N{NO-BREAK SPACE}l/min"
    assert row(numbered["period_1"]).printed == "0.013 s"
    assert row(numbered["mu_release"]).printed == "3.7 × 10³ N·s/m"
    assert row(numbered["period_1"]).erratum == "roots"


def test_a_load_history_is_felt_by_the_load_cell_and_the_solver_balances():
    """A slow ramp: load cell, oil and plate share the load, x_HC = -F/k_LC."""
    times, loads = np.array([0.0, 4.0]), np.array([0.0, 4e4])
    effects = tuple(equations.CATALOGUE[name] for name in equations.BASE)
    asked = np.linspace(0.0, 4.0, 9)
    values = [{**nominal(NUMBERS), "mu": 3.7e3}]
    found = run(effects, values, [Stretch(4.0)], asked, (times, loads))
    load = np.interp(asked, times, loads)
    # Out of the first oscillation: 1e4 N/s against a stiffness of 60 MN/m over 0.235 s of decay.
    np.testing.assert_allclose(found.load[0][4:], load[4:], rtol=2e-3)
    np.testing.assert_allclose(
        found.plunger[0] - found.stroke[0], -found.load[0] / 0.6e8, rtol=0, atol=1e-12
    )
    assert jnp.isfinite(jnp.asarray(found.pressure)).all()


def test_ice_load_is_shared_and_gone_after_the_failure():
    whole = sum(ice_load(NUMBERS, name)[1].max() for name in SHARES)
    assert whole == pytest.approx(157.5e3)
    for name in SHARES:
        times, loads = ice_load(NUMBERS, name)
        assert np.interp(25.0, times, loads) == 0.0
        assert np.interp(50.0, times, loads) == loads.max()
        assert np.interp(50.1, times, loads) == 0.0


def test_mathml():
    assert words("k_LC = 0.6") == (
        "<msub><mi>k</mi><mi mathvariant='normal'>LC</mi></msub><mo>=</mo><mn>0.6</mn>"
    )
    assert words("tanh [") == "<mi>tanh</mi><mo>[</mo>"
    assert words("a < b") == "<mi>a</mi><mo>&lt;</mo><mi>b</mi>"
    assert str(equation("y")).startswith("<math display='block'>")
