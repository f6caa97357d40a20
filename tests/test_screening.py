"""Score tests and evidence: nothing where nothing is, and a planted effect by its strength."""

import dataclasses
import re

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, SHEETS, converted, drive, effects, parameters, track

from rigid.discovery import signatures as bench
from rigid.discovery.fitted import Fitted
from rigid.discovery.outcome import Outcome
from rigid.discovery.turn import Running, weigh
from rigid.discovery.unmodelled.base import Bumps
from rigid.discovery.unmodelled.formula import simplest
from rigid.discovery.unmodelled.sensors import SensorError
from rigid.discovery.weighing import explain
from rigid.discovery.workflow import discover
from rigid.effects import CATALOGUE
from rigid.io.cache import Shelf
from rigid.likelihood.channels import make_pieces
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.priors import Lognormal, Normal
from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Series
from rigid.localfit import expansion
from rigid.localfit.ascent import refined
from rigid.localfit.candidates import candidates
from rigid.localfit.evidence import Bundle, amplitudes, log_bayes
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import Family, families, quiet_values, sweep
from rigid.localfit.hidden_inputs import HiddenDrag
from rigid.localfit.hypothesis import Hypothesis, start, widened
from rigid.localfit.leave_one_out import Judged, held_out_gap, left_out, units
from rigid.localfit.local import LocalFit, with_weights
from rigid.localfit.noise.codes import Codes
from rigid.localfit.noise.leftover import Traces
from rigid.localfit.noise.weights import facts
from rigid.localfit.samples import lay_out
from rigid.localfit.screening import Around, Screening, gram, screen
from rigid.localfit.signature import lanes_of, signatures
from rigid.localfit.where import where_shown
from rigid.physics.rig import FREE, build_rig
from rigid.report.noise_found import noise_found

LISTED = ("piston-leakage", "hose-pressure-drop", "clock-offset", "load-cell-drift")
CHOICE = tuple(CATALOGUE[name] for name in LISTED)


def campaign(seed: int, choice=CHOICE, **hidden: float) -> Problem:
    """Free runs of the linear rig; one of the effects `choice` acts, of the given strength."""
    tracks = tuple(
        track(f"free-run-{i},A", "free-run", 500, drive=drive(500, (0.5, 3.0), (0, 1, 0)))
        for i in (1, 2)
    )  # fmt: skip
    flows = {"kappa[free-run-1,A]": 0.2, "kappa[free-run-2,A]": 0.05}
    listed = parameters(
        {"mu": Lognormal(1e6, 1.5), **{k: Lognormal(v, 1.2) for k, v in flows.items()}},
        quantities=("load,A", "stroke,A", "pressure,A"),
    )
    silent = {
        "C_leak": 0.0,
        "R_hose": 0.0,
        "q_fittings": 1e-3,
        "pressure_delay": 0.0,
        "load_delay_ratio": 0.5,
        "load_drift": 0.0,
    }
    truth = listed.values(jnp.zeros((1, listed.size)))
    truth = truth | {"mu": jnp.asarray([1e6])}
    truth = truth | {k: jnp.asarray([v]) for k, v in (silent | hidden).items()}
    ideal = SlowGroup(tracks, effects(BASE) + choice).predict(truth)
    rng = np.random.default_rng(seed)
    series = {}
    for i, one in enumerate(tracks):
        data = {q: converted(ideal[q][:, i, 0], SHEETS[q], rng) for q in ideal}
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    groups = (SlowGroup(tracks, effects(BASE)),)
    return Problem(effects(BASE), listed, groups, make_pieces(groups, series, SHEETS))


@pytest.fixture(scope="module")
def listed():
    return candidates(CHOICE, 2)


def fitted(problem: Problem, choice=CHOICE) -> tuple[LocalFit, tuple]:
    """The base model at its best, from the centre of the prior, and its programs."""
    programs = families(problem, choice)
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    w = start(problem, np.zeros(problem.parameters.size), np.zeros((len(problem.sensors), 2)))
    begun = expanded(programs[0], Point(Hypothesis(problem), lay_out(problem), w, noise))
    return refined(begun, most=40), programs


def screened(problem: Problem, listed) -> Screening:
    local, programs = fitted(problem)
    around = Around(local.terms.score, local.terms.curvature, local.design, local.gradient)
    return screen(around, signatures(local, programs, listed))


@pytest.mark.slow
def test_where_nothing_is_missing_strengths_are_standard_normal(listed):
    """Whitened by their correlation: the sum of squares is chi squared, 4 a campaign."""
    total = 0.0
    for seed in range(6):
        found = screened(campaign(200 + seed), listed)
        total += found.slope @ np.linalg.solve(found.information, found.slope)
    assert 9.9 < total < 45.6  # chi squared of 24 degrees of freedom, 99.5 % either way


@pytest.mark.slow
def test_a_planted_effect_comes_out_by_its_strength(listed):
    names = [one.effect.name for one in listed]
    at = names.index("load-cell-drift")  # the records are linear in it
    quiet = screened(campaign(300), listed)
    drift = 8.0 / np.sqrt(quiet.information[at, at])
    found = screened(campaign(300, load_drift=drift), listed)
    # The same noise before the converter, other roundings after it: of n samples, each moved by
    # d = 8/sqrt(n) noise sds of a step of 2, a share d/2 changes its code, which scatters the
    # strength by sqrt(n d (2 - d) / n) = 0.66 at n = 1,000.
    assert found.strength[at] - quiet.strength[at] == pytest.approx(8.0, abs=3 * 0.66)
    assert int(np.argmax(np.abs(found.strength))) == at


@pytest.mark.slow
def test_a_run_that_goes_on_reads_its_traces(tmp_path, monkeypatch):
    """To the last bit, and without a simulation."""
    local, programs = fitted(campaign(306))
    made = bench.laid_out(Fitted(local, programs), CHOICE, Shelf(tmp_path))
    monkeypatch.setattr(bench, "signatures", None)
    read = bench.laid_out(Fitted(local, programs), CHOICE, Shelf(tmp_path, reads=True))
    np.testing.assert_array_equal(made.signatures, read.signatures)
    np.testing.assert_array_equal(made.bumps.columns, read.bumps.columns)
    np.testing.assert_array_equal(made.bumps.centre, read.bumps.centre)
    assert made.bumps.target == read.bumps.target
    assert made.listed == read.listed


def found_in(problem: Problem) -> Outcome:
    w = np.zeros(problem.parameters.size)
    local, _ = fitted(problem)
    z = w.copy()
    free = [i for i, p in enumerate(problem.parameters.sampled) if p.base != "noise"]
    z[free] = local.w[: len(free)]
    best = z, local.hypothesis.sensors(local.w)
    return discover(problem, best, CHOICE, {}, Running(0))


@pytest.mark.slow
def test_workflow_names_what_is_hidden_and_nothing_where_nothing_is():
    assert found_in(campaign(301)).verdict == "nothing-missing"
    # A strong one: taken for correlated noise, it would hide itself.
    found = found_in(campaign(302, R_hose=4e9))
    assert found.verdict == "named"
    (step,) = found.steps
    assert (step.chosen, step.equation) == ("hose-pressure-drop", "sensor")
    assert step.place.channel == "pressure"
    assert step.judged is not None
    assert step.judged.gap[1] < step.judged.gap[0]
    assert step.judged.elpd[0] > 0.0
    assert step.placebo < 0.2
    after = step.refits[step.chosen].after
    number = after.hypothesis.labels.index("R_hose")
    sd = 4e9 * np.log(10.0) * float(np.sqrt(after.covariance[number, number]))
    assert after.hypothesis.values(after.w)["R_hose"][0] == pytest.approx(4e9, abs=4 * sd)


@pytest.mark.slow
def test_leaving_records_out_adds_up_to_the_evidence_of_independent_ones():
    """With nothing shared between two records the densities of both make the whole integral."""
    local, _ = fitted(campaign(303))
    parts = units(local, None)
    assert len(parts) == 2
    design = np.zeros_like(local.design)
    for number, rows in enumerate(parts):
        own = [2 * number, 2 * number + 1]
        design[np.ix_(rows, own)] = local.design[rows][:, -2:] + 1e-3
    apart = dataclasses.replace(local, design=design, w=np.zeros(len(local.w)))
    expected = []
    for rows in parts:
        columns = design[rows]
        precision = np.eye(len(local.w)) + columns.T @ (columns * local.terms.curvature[rows, None])
        pull = columns.T @ local.terms.score[rows]
        gain = 0.5 * pull @ np.linalg.solve(precision, pull)
        value = local.terms.value[rows].sum() + gain
        expected.append(value - 0.5 * np.linalg.slogdet(precision)[1])
    np.testing.assert_allclose(
        left_out({"": Judged(apart)}, parts)[""].density, expected, rtol=1e-9
    )
    # A left-out record is not fitted better than a fitted one, one step ahead or not, by 2 %.
    assert held_out_gap(local, parts) >= 0.98 * np.sqrt(
        np.mean((local.residual / local.layout.floor) ** 2)
    )


@pytest.mark.slow
def test_a_spike_does_not_count_and_correlated_noise_counts_less():
    local, programs = fitted(campaign(304))
    columns = Traces.of(signatures(local, programs, candidates(CHOICE, 1)))
    clean = facts(local, columns).weight
    residual = local.residual.copy()
    rows = np.flatnonzero(local.layout.channel == 0)
    residual[rows[100]] += 20.0 * local.layout.floor[rows[100]]
    spiked = dataclasses.replace(local, residual=residual)
    assert facts(spiked, columns).weight[rows[100]] == 0.0
    rng = np.random.default_rng(304)
    score = local.terms.score.copy()
    fresh = rng.standard_normal(len(rows))
    slow = np.zeros(len(rows))
    for i in range(1, len(rows)):
        slow[i] = 0.8 * slow[i - 1] + 0.6 * fresh[i]
    score[rows] = slow * score[rows].std()
    coloured = dataclasses.replace(local, terms=local.terms._replace(score=score))
    # An AR(1) of coefficient 0.8 has a correlation time of (1 + 0.8)/(1 - 0.8) = 9 samples; its
    # estimate from n = 500 scatters by some tenths: a factor of 2.5 either way.
    weight = facts(coloured, columns).weight[rows].max()
    assert clean[rows].max() / 22.0 < weight < clean[rows].max() / 3.6
    assert with_weights(local, clean).value == pytest.approx(local.value, rel=0.3)


@pytest.mark.slow
def test_noise_of_heavy_tails_is_found_and_told():
    local, programs = fitted(campaign(306))
    columns = Traces.of(signatures(local, programs, candidates(CHOICE, 1)))
    assert facts(local, columns).tails == {}
    rng, residual, dof = np.random.default_rng(306), local.residual.copy(), 4.0
    rows = np.array([c.quantity == "load" for c in local.layout.channels])[local.layout.channel]
    sheet, exact = SHEETS["load"], local.reading[rows]
    noise = sheet.noise * np.sqrt((dof - 2.0) / dof) * rng.standard_t(dof, rows.sum())
    residual[rows] = sheet.step * np.round((exact + noise) / sheet.step) - exact
    heavy = with_weights(dataclasses.replace(local, residual=residual), np.ones(len(residual)))
    found = facts(heavy, columns)
    assert list(found.tails) == ["load"]
    assert 2.5 <= found.tails["load"] <= 8.0
    far = np.abs(residual) > 4.0 * sheet.floor
    assert found.weight[rows & far].max() < 0.5 * np.median(found.weight[rows & ~far])
    # What explains one sample alone makes it no nearer to the others.
    some = rows & (found.weight > 0.0)  # no spike
    worst = int(np.argmax(np.where(some, np.abs(residual), 0.0)))
    alone = np.zeros((len(residual), 1))
    alone[worst] = sheet.floor
    own = facts(heavy, Traces.of(np.concatenate([columns.columns, alone], axis=1)))
    assert own.weight[worst] < 0.5 * np.median(own.weight[rows & ~far])
    after = refined(found.of(heavy))
    told = {one["sensor"]: one for one in noise_found(after)}
    assert told["load,A"]["degrees_of_freedom"] == found.tails["load"]
    # 1,000 samples of four degrees of freedom tell their sd to some 10 %
    assert told["load,A"]["sd"] == pytest.approx(sheet.noise, rel=0.3)
    assert told["pressure,A"]["degrees_of_freedom"] is None


@pytest.mark.slow
def test_noise_that_grows_with_the_reading_is_found_and_told():
    local, programs = fitted(campaign(306))
    columns = Traces.of(signatures(local, programs, candidates(CHOICE, 1)))
    assert np.all(facts(local, columns).loud == 1.0)
    rng, residual = np.random.default_rng(306), local.residual.copy()
    rows = np.array([c.quantity == "stroke" for c in local.layout.channels])[local.layout.channel]
    sheet, exact = SHEETS["stroke"], local.reading[rows]
    share = np.abs(exact) / np.abs(exact).max()
    # in a straight line, as in no law of the package
    noise = sheet.noise * (1.0 + 6.0 * share) * rng.standard_normal(rows.sum())
    residual[rows] = sheet.step * np.round((exact + noise) / sheet.step) - exact
    louder = with_weights(dataclasses.replace(local, residual=residual), np.ones(len(residual)))
    found = facts(louder, columns)
    assert found.tails == {}
    assert np.all(found.loud[~rows] == 1.0)
    assert found.loud[rows].max() > 4.0 * found.loud[rows].min()
    counts = found.weight[rows]
    quiet, loud = np.median(counts[share < 0.05]), np.median(counts[share > 0.9])
    assert 0.0 < loud < 0.2 * quiet
    # as many facts as before
    assert np.mean(1.0 / found.loud[rows]) == pytest.approx(1.0, rel=0.02)
    after = refined(found.of(louder))
    told = {one["sensor"]: one for one in noise_found(after)}
    assert told["stroke,A"]["sd_least"] < 1.5 * sheet.noise
    assert told["stroke,A"]["sd_greatest"] > 2.0 * sheet.noise
    assert told["pressure,A"]["sd_greatest"] is None
    # Simulated campaigns are as loud where the reading is large.
    simulated = Codes.of(after).sigma[rows]
    assert simulated[np.argmax(share)] == pytest.approx(told["stroke,A"]["sd_greatest"], rel=0.3)


@pytest.mark.slow
def test_differences_are_derivatives(listed, monkeypatch):
    """Traces and slopes of a rig that is not steady come of differences; here of one that is."""
    local, programs = fitted(campaign(305))
    exact = signatures(local, programs, listed)
    monkeypatch.setattr(Family, "steady", False)
    off = np.linalg.norm(signatures(local, programs, listed) - exact, axis=0)
    assert np.all(off < 1e-3 * np.linalg.norm(exact, axis=0))
    again = expanded(local.family, Point.beside(local, local.w))
    off = np.linalg.norm((again.design - local.design) / local.layout.floor[:, None], axis=0)
    assert off.max() < 0.1


@pytest.mark.slow
def test_numbers_of_one_record_each_that_change_together_have_the_slopes_they_have_alone(
    monkeypatch,
):
    local, _ = fitted(campaign(305))
    together, count = expansion.directions(local.hypothesis), len(local.hypothesis.parameters)
    assert sorted(i for some in together for i in some) == list(range(count))
    assert len(together) < count
    monkeypatch.setattr(expansion, "directions", lambda _: [[i] for i in range(count)])
    again = expanded(local.family, Point.beside(local, local.w))
    np.testing.assert_allclose(again.design, local.design, rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_another_law_of_numbers_that_are_in_already_is_no_candidate(listed):
    local, programs = fitted(campaign(301))
    drift = CATALOGUE["load-cell-drift"]
    twin = type("Twin", (drift,), {"name": "twin"})
    twins = tuple(dataclasses.replace(o, effect=twin) for o in listed if o.effect is drift)
    rng = np.random.default_rng(404)
    columns = rng.standard_normal((len(local.residual), len(listed) + len(twins) + 1))
    hidden = Bumps(columns[:, -1:], (SensorError("stroke", "time"),), np.zeros(1))
    made = bench.Bench(programs, listed + twins, hidden, columns)
    assert set(weigh(local, made, 0).effects) == {*LISTED, "twin"}
    more = widened(local.hypothesis, local.w, [0.1])
    extended = Hypothesis(local.layout.problem).plus(drift)
    with_it = expanded(programs[0], Point(extended, local.layout, more, local.z_noise))
    assert set(weigh(with_it, made, 0).effects) == set(LISTED) - {"load-cell-drift"}


def test_products_are_those_of_all_samples_whatever_is_left_out():
    """Traces of one record each, over more samples than are multiplied at a time."""
    rng = np.random.default_rng(402)
    columns, bend = rng.standard_normal((3000, 7)), rng.uniform(-0.1, 1.0, 3000)
    columns[:1500, :3] = columns[2000:, 3:5] = 0.0
    parts = columns[:, :2], columns[:, 2:]
    np.testing.assert_allclose(gram(parts, bend), columns.T @ (columns * bend[:, None]))


def test_campaigns_of_a_complete_model_have_the_correlation_of_the_traces(monkeypatch):
    """2,000 draws give a correlation within 5/sqrt(2,000) = 0.11."""
    rng = np.random.default_rng(403)
    signatures = rng.standard_normal((50, 4)) @ np.diag([1.0, 10.0, 0.1, 1.0])
    signatures[:, 3] = signatures[:, 0]  # in its span
    information = signatures.T @ signatures
    size = np.sqrt(np.diag(information))
    monkeypatch.setattr(explain, "SIMULATED", 2000)
    drawn = explain.null_draws(information, 3) / size
    expected = information / np.outer(size, size)
    np.testing.assert_allclose(drawn.T @ drawn / len(drawn), expected, atol=0.11)


@pytest.mark.slow
def test_a_simulation_that_is_not_asked_for_is_left_out():
    """Readings and slopes of the kinds asked for are what they are without the question."""
    local, programs = fitted(campaign(306))
    values = lanes_of(local, {"R_hose": np.zeros(3)}, 3)
    along = {"R_hose": np.array([1.0, 0.0, 1.0]), "C_leak": np.array([0.0, 1.0, 0.0])}
    (whole,) = sweep(programs[0], values, along)
    (asked,) = sweep(programs[0], values, along, {"free-run": np.array([True, False, True])})
    for all_lanes, some in zip(whole, asked, strict=True):
        for quantity, series in all_lanes.items():
            np.testing.assert_array_equal(some[quantity][..., [0, 2]], series[..., [0, 2]])
            assert not some[quantity][..., 1].any()
    assert whole[1]["pressure"][..., 1].any()
    # An effect that acts in none of the records: both parts are there, and nothing in them.
    (none,) = sweep(programs[0], values, along, {"free-run": np.zeros(3, bool)})
    for part, other in zip(none, whole, strict=True):
        assert {q: series.shape for q, series in part.items()} == {
            q: series.shape for q, series in other.items()
        }
        assert not any(series.any() for series in part.values())


def test_a_hidden_force_on_the_cylinder_is_not_read():
    """100 N accelerate M_HC - M_Pl = 50 kg; load cell and plunger do not feel it at once."""
    more = quiet_values(HiddenDrag) | {"hidden_drag[1]": 100.0}
    rigs = (
        build_rig(effects(BASE), NOMINAL),
        build_rig((*effects(BASE), HiddenDrag), NOMINAL | more),
    )
    without, pushed = (rig.motion(jnp.zeros(5), FREE) for rig in rigs)
    assert float(pushed.rates[1] - without.rates[1]) == pytest.approx(2.0)
    assert float(pushed.load) == float(without.load)
    assert float(pushed.plunger_acceleration) == float(without.plunger_acceleration)


def test_projecting_out_is_refitting():
    """What the fit can absorb leaves no trace; what it cannot leaves all of it."""
    rng = np.random.default_rng(400)
    design, score = rng.standard_normal((300, 4)), rng.standard_normal(300)
    around = Around(score, np.ones(300), 1e6 * design, np.zeros(4))
    free = rng.standard_normal(300)
    free -= design @ np.linalg.lstsq(design, free, rcond=None)[0]
    found = screen(around, np.stack([design @ [1.0, 2.0, 0.0, -1.0], free], axis=1))
    assert found.information[0, 0] < 1e-6
    assert found.information[1, 1] == pytest.approx(free @ free)


def test_a_trace_of_which_nothing_is_left_says_nothing():
    """As in a stroke sensor that stands still in the middle of a wide step."""
    rng = np.random.default_rng(3)
    score, bend = rng.normal(size=300), np.repeat((1.0, 0.0), 150)
    design = np.ones((300, 1))
    still, absorbed, seen = np.repeat((0.0, 1.0), 150), 1e9 * design[:, 0], rng.normal(size=300)
    around = Around(score, bend, 1e9 * design, np.zeros(1))
    found = screen(around, np.stack([still, absorbed, seen], axis=1))
    assert found.strength[:2].tolist() == [0.0, 0.0]
    assert abs(found.strength[2]) > 0.01
    here = Bundle(np.array([0, 1, 2]), found.information)
    alone = Bundle(np.array([2]), found.information)
    assert float(here.log_bayes(found.slope)) == pytest.approx(float(alone.log_bayes(found.slope)))


def test_bayes_factor_of_a_gaussian_amplitude_is_the_closed_form():
    """N(0, s): ln B = g^2 s^2 / (2 (1 + I s^2)) - ln(1 + I s^2)/2."""
    law = Normal(0.0, 2.0)
    for slope, information in ((0.0, 3.0), (7.0, 3.0), (-40.0, 25.0)):
        shrunk = 1.0 + information * 4.0
        expected = 0.5 * slope**2 * 4.0 / shrunk - 0.5 * np.log(shrunk)
        got = log_bayes(np.asarray(slope), np.asarray(information), amplitudes(law, 0.0))
        assert float(got) == pytest.approx(expected, abs=1e-6)


def test_a_bundle_of_one_bump_and_a_sign_that_is_forbidden():
    """A bundle has no sign; an amplitude whose prior is positive refuses a negative slope."""
    one = Bundle(np.array([0]), np.array([[4.0]]))
    assert one.log_bayes(np.array([16.0])) == pytest.approx(one.log_bayes(np.array([-16.0])))
    assert float(one.log_bayes(np.array([16.0]))) > 20.0
    positive = amplitudes(Lognormal(3.0, 2.0), 0.0)
    assert float(log_bayes(np.asarray(16.0), np.asarray(4.0), positive)) > 20.0
    assert float(log_bayes(np.asarray(-16.0), np.asarray(4.0), positive)) < -5.0


def test_curves_of_many_candidates_are_interpolated_between_few():
    """Events all through a record: within 0.05 of the curve of each, up to a strength of 6."""
    departures = amplitudes(Lognormal(1.0, 1.4), 1.0)
    sizes = np.geomspace(1.0, 1e3, 60)
    found = explain.curves_of(departures, sizes)
    for size, curve in zip(sizes, found, strict=True):
        exact = log_bayes(explain.Z_GRID * size, np.full(len(curve), size**2), departures)
        near = np.abs(explain.Z_GRID) < 6.0
        np.testing.assert_allclose(curve[near], exact[near], atol=0.05)


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (lambda u: 3.0 * np.sign(u), "3 sgn(v)"),
        (lambda u: 2.0 * u, "2 v"),
        (lambda u: u * abs(u), "1 v |v|"),
    ],
)
def test_the_simplest_formula_is_found(curve, words):
    place = np.linspace(-2.0, 2.0, 9)
    noise = 0.01 * np.random.default_rng(401).standard_normal(9)
    found = simplest(place, curve(place) + noise, 1e-4 * np.eye(9), "v")
    assert found is not None
    number, form = found.words.split(" ", 1)
    assert form == words.split(" ", 1)[1]
    assert float(number) == pytest.approx(float(words.split()[0]), abs=0.03)


def test_a_curve_of_straight_pieces_is_close_to_a_formula():
    """However well it is known: here to a hundred-thousandth, where it bends at six places."""
    place = np.linspace(-2.0, 2.0, 6)
    wide = np.linspace(-2.0, 2.0, 400)
    columns = np.maximum(0.0, 1.0 - np.abs(wide[:, None] - place) / 0.8)
    mean = np.linalg.lstsq(columns, 3.0 * wide - 2.0 * wide**3, rcond=None)[0]
    found = simplest(place, mean, 1e-10 * np.eye(6), "x")
    assert found is not None
    told = re.fullmatch(r"(\S+) x - (\S+) x\^3", found.words)
    assert told is not None
    assert float(told[1]) == pytest.approx(3.0, rel=0.3)  # what pieces leave looks like a line
    assert float(told[2]) == pytest.approx(2.0, rel=0.1)


def test_where_no_formula_fits_there_is_none():
    """A narrow bump, told to 5 %, among forms that are straight, even or odd."""
    place = np.linspace(-2.0, 2.0, 9)
    assert simplest(place, np.exp(-(((place - 1.0) / 0.4) ** 2)), 25e-4 * np.eye(9), "v") is None


@pytest.mark.slow
def test_a_change_that_no_sample_feels_has_a_place_all_the_same():
    """Samples without curvature (weight 0, or a reading at its end) do not upset the search."""
    local, _ = fitted(campaign(305))
    flat = dataclasses.replace(
        local, terms=local.terms._replace(curvature=-np.ones_like(local.terms.curvature))
    )
    found = where_shown(flat, np.ones_like(local.reading), np.ones_like(local.reading))
    assert found.track in flat.layout.tracks
    assert found.time_s is not None
    assert found.time_s[0] <= found.time_s[1]
