"""Whether a result may be used, and what the page says of it: one rule, one paper."""

import dataclasses

import numpy as np
import pytest
from rigs import release_problem

from rigid.inference.calibrate import propose
from rigid.inference.newton import is_noise
from rigid.inference.sampling import LEAST_SHARE, MOST_OVERLOOKED
from rigid.inference.search import search
from rigid.likelihood.assemble import assemble
from rigid.plots.metrology import chance
from rigid.records.read import read_records
from rigid.report.bands.output import as_dict
from rigid.report.calibration.budget import OTHERS, REPEATED, _budget
from rigid.report.calibration.for_paper import latex
from rigid.report.calibration.present import flow_fractions
from rigid.report.paper_values import of_the_paper, published, published_frictions
from rigid.report.usability import MOST_CHANNEL_GAP, MOST_GAP, covered, noise, residuals
from rigid.smoothing.budget import Line
from rigid.smoothing.finished import Finished
from rigid.smoothing.laws import RigModel
from rigid.spec import Known, find_spec, load_spec

LINE = Line("total", "peak load", "N", 5e4, 4.9e4, 5.1e4, 600.0, (400.0, None, 500.0, None, 100.0))
DONE = Finished(
    "press", ("A",), (LINE,), (), (), {"load of press,A": 1.01}, {"press,A": "ab"}, (), (), "field"
)
LAW = RigModel("memory", 1.0, (), {"k_LC": np.ones(3)})


@pytest.mark.parametrize(
    ("overall", "worst", "ok"),
    [
        (1.0, 1.2, True),
        (MOST_GAP + 0.01, MOST_GAP + 0.01, False),
        (1.1, MOST_CHANNEL_GAP + 0.01, False),
    ],
)
def test_residuals_have_one_rule_for_all_commands(overall, worst, ok):
    check = residuals(overall, {"load of frame-1,A": 1.0, "stroke of frame-1,A": worst})
    assert check.ok == ok
    assert "stroke of frame-1,A" in check.says


def test_bands_of_a_fit_that_is_not_usable_are_not_usable():
    good = as_dict("field", True, 1, [DONE], [LAW])
    assert good["usable"]
    failed = dataclasses.replace(LAW, failed="converged: R-hat is 1.3")
    bad = as_dict("field", True, 1, [DONE], [LAW, failed])
    assert not bad["usable"]
    [check] = [one for one in bad["checks"] if not one["ok"]]
    assert check["name"] == "posterior"
    assert "R-hat is 1.3" in check["says"]


@pytest.mark.parametrize(
    ("value", "said"),
    [(0.0, "< 0.001"), (1.0, "> 0.999"), (0.9994, "0.999"), (0.5, "0.500"), (0.9996, "> 0.999")],
)
def test_no_probability_is_nought_or_one(value, said):
    assert chance(value) == said


def test_another_rig_is_not_compared_with_the_paper():
    spec = load_spec(find_spec("calibration"))
    records = read_records(spec)
    assert of_the_paper(assemble(spec, records))
    heavier = spec.rig.model_copy(update={"M_HC": Known(value=75.0, sd=2.0)})
    other = assemble(spec.model_copy(update={"rig": heavier}), records)
    assert not of_the_paper(other)
    assert published("k_LC", ours=True)
    assert published("k_LC", ours=False) == published_frictions(ours=False) == ()


def test_flow_fractions_that_say_the_same_are_one_row():
    rng = np.random.default_rng(3)
    found = [0.1 * i + 1e-3 * rng.standard_normal((1, 500)) for i in (1, 2, 3)]
    [opened] = flow_fractions("valve open", found, ours=False)
    assert opened.label == "flow fractions, valve open (3 settings)"
    low, high = (float(end) for end in opened.range.split(" to "))
    assert (low, high) == pytest.approx((0.1, 0.3), abs=1e-3)
    [tank] = flow_fractions("valve to the tank", found[:1], ours=False)
    assert (tank.label, tank.range) == ("flow fraction, valve to the tank", "")
    assert "paper" not in opened.reading
    [ours] = flow_fractions("valve open", found, ours=True)
    assert "paper" in ours.reading
    assert flow_fractions("valve open", [], ours=True) == []


def test_a_budget_finds_what_a_number_is_made_of():
    """y = 3 a - 0.5 b + noise; n draws leave each contribution uncertain by 1/sqrt(2 n)."""
    n = 40_000
    a, b, noise = np.random.default_rng(7).standard_normal((3, n))
    inputs = {"a": 10.0 + 2.0 * a, "b": b, "c": np.full(n, 4.0)}
    values = 3.0 * inputs["a"] - 0.5 * b + 4.0 * noise
    made = _budget("y", "N", values, inputs, {"a": "m", "b": "s", "c": "1"})
    lines = {line.source: line for line in made.lines}
    tolerance = 5.0 / np.sqrt(2.0 * n)
    assert set(lines) == {"a", OTHERS, REPEATED}  # b holds 0.5 % of the variance
    assert lines["a"].contribution == pytest.approx(6.0, rel=tolerance + 5 * 4.0 / 6.0 / np.sqrt(n))
    assert lines["a"].sensitivity == pytest.approx(3.0, abs=5 * 4.0 / 2.0 / np.sqrt(n))
    assert lines[REPEATED].contribution == pytest.approx(4.0, rel=tolerance)
    assert made.combined == pytest.approx(np.sqrt(36.0 + 0.25 + 16.0), rel=tolerance)


@pytest.mark.slow
def test_noise_far_above_its_sheet_is_told():
    found = search(release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64), 2, 1)
    assert noise(found).ok
    best = found.optima[0]
    loud = np.where(is_noise(found.problem), 4.0, best.z)
    louder = dataclasses.replace(found, optima=(dataclasses.replace(best, z=loud),))
    check = noise(louder)
    assert not check.ok
    assert "acceleration,A is 5.1 times" in check.says, check.says


@pytest.mark.slow
def test_walkers_that_begin_in_a_law_that_misses_a_part_are_not_trusted():
    found = search(release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64), 2, 1)
    known = propose(found, np.random.default_rng(1))
    few = dataclasses.replace(known.weights, kish=0.99 * LEAST_SHARE)
    assert covered(known, weighed=False).ok
    for less in (known._replace(weights=few), known._replace(overlooked=MOST_OVERLOOKED)):
        assert not covered(less, weighed=False).ok
        assert "R-hat does not show" in covered(less, weighed=False).says
        assert covered(less, weighed=True).ok


def test_a_budget_without_inputs_is_all_scatter():
    """A motion of exact sensors whose numbers are all told, as EMPS: its page once failed."""
    values = np.random.default_rng(7).standard_normal(100)
    made = _budget("y", "N", values, {"c": np.full(100, 4.0)}, {"c": "1"})
    assert [line.source for line in made.lines] == [REPEATED]
    assert made.lines[0].contribution == pytest.approx(made.combined)


def test_text_is_no_command_of_latex():
    said = latex("a_b & 5 % \\input{x} \N{MINUS SIGN}1 \N{MULTIPLICATION SIGN} 10⁻³")
    assert said == (r"a\_b \& 5 \% \textbackslash{}input\{x\} $-$1 $\times$ 10$^{-3}$")
