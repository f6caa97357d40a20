"""Simulation-based calibration: exact tests of ranks, and whole studies of a small machine."""

import dataclasses
import itertools
import json
from collections import Counter
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from jax import monitoring
from scipy.stats import binom, chi2, norm
from test_compilations import COMPILED
from test_study import write_cart

import rigid
from rigid.inference.calibrate import propose
from rigid.inference.sampling import LEAST_SHARE
from rigid.inference.search import search
from rigid.io.errors import InputError
from rigid.jobs.job import Given
from rigid.jobs.rows import read_rows
from rigid.report.content import BAD, RESERVE
from rigid.report.validation.present import front
from rigid.study.validation import Replicates
from rigid.validate import main
from rigid.validation import draws, replicate
from rigid.validation.agreement import agreement
from rigid.validation.broken import broken, kept
from rigid.validation.campaign import Base, coloured, converted, draw, moved, standard
from rigid.validation.coverage import POWER, coverage, shown_from
from rigid.validation.design import BREAKS, Design, arguments, read_arguments
from rigid.validation.draws import ESS, weighted
from rigid.validation.ecdf import band, counts, p_value, points
from rigid.validation.misfit import effects, first_for_each
from rigid.validation.replicate import one
from rigid.validation.score import score
from rigid.validation.tested import ALPHA, holm
from rigid.validation.verdict import verdict

ROOT = Path("/")
SEED = 20
COUNT = 24


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> rigid.Study:
    return rigid.load(write_cart(tmp_path_factory.mktemp("cart")))


@pytest.fixture(scope="module")
def base(study) -> Base:
    return Base(study.spec, study.records, study.problem)


@pytest.fixture(scope="module")
def sound(study) -> rigid.Validation:
    return study.validate(Replicates(COUNT), seed=SEED, quiet=True)


def every_sample(n: int, cells: int) -> dict[tuple[int, ...], float]:
    """Probability of every distribution of n uniform ranks over equal cells."""
    found: Counter = Counter()
    for places in itertools.product(range(cells), repeat=n):
        found[tuple(np.cumsum(np.bincount(places, minlength=cells))[:-1])] += 1
    return {path: times / cells**n for path, times in found.items()}


@pytest.mark.parametrize("n", [2, 4, 5])
def test_the_probability_of_ranks_is_that_of_all_samples(n):
    every = every_sample(n, n)
    at = points(n)

    def least_tail(path: tuple[int, ...]) -> float:
        k = np.array(path)
        tails = 2.0 * np.minimum(binom.cdf(k, n, at), binom.sf(k - 1, n, at))
        return float(np.minimum(tails, 1.0).min())

    for path in list(every)[:: max(1, len(every) // 20)]:
        inside = np.diff(np.concatenate([[0], path, [n]]))
        ranks = np.repeat((np.arange(n) + 0.5) / n, inside)
        assert tuple(counts(ranks)) == path
        mine = least_tail(path) * (1.0 + 1e-9)
        exact = sum(chance for other, chance in every.items() if least_tail(other) <= mine)
        assert p_value(ranks) == pytest.approx(exact, abs=1e-12)


def test_the_band_holds_whole_curves_as_often_as_it_says():
    n, studies, level = 60, 4000, 0.95
    least, greatest = band(n, level)
    found = np.array([counts(r) for r in np.random.default_rng(5).random((studies, n))])
    held = np.all((found >= least) & (found <= greatest), axis=1).mean()
    # The band keeps at least its level; counts are whole, so that it can keep somewhat more.
    error = 4.0 * np.sqrt(level * (1.0 - level) / studies)
    assert level - error < held < level + 0.01 + error


def test_ranks_that_crowd_at_the_ends_or_to_one_side_are_seen():
    rng = np.random.default_rng(6)
    z = rng.standard_normal(200)
    assert p_value(norm.cdf(z)) > 0.05
    assert p_value(norm.cdf(2.0 * z)) < 1e-6  # errors twice as large as stated
    assert p_value(norm.cdf(0.5 * z)) < 1e-6  # half
    assert p_value(norm.cdf(z + 0.5)) < 1e-6  # half an error to one side


def test_coverage_counts_central_intervals():
    found = coverage(np.array([0.01, 0.05, 0.3, 0.5, 0.95, 0.97]), 0.9)
    assert (found.hits, found.n) == (4, 6)
    assert found.low < found.share < found.high


def test_what_a_study_would_show_is_what_a_count_shows():
    n, level, alpha = 200, 0.9, 1e-4
    least = shown_from(n, level, alpha)
    hits = np.arange(n + 1)
    rejected = [k for k in hits if k < level * n and 2.0 * binom.cdf(k, n, level) <= alpha]
    assert binom.cdf(max(rejected), n, least) >= POWER
    assert binom.cdf(max(rejected), n, least + 2e-3) < POWER
    assert shown_from(5, level, 1e-9) == 0.0


def test_probabilities_are_corrected_for_their_number():
    np.testing.assert_allclose(holm(np.array([0.01, 0.04, 0.03, 0.005])), [0.03, 0.06, 0.06, 0.02])


def test_noise_has_the_stated_colour_and_converters_their_steps(base):
    noise = coloured(np.random.default_rng(1), 200_000, 0.8)
    # Of an autoregression both have errors of sqrt((1 + c^2)/(1 - c^2)/n) or less, here 0.005.
    assert np.var(noise) == pytest.approx(1.0, abs=0.03)
    assert np.mean(noise[1:] * noise[:-1]) == pytest.approx(0.8, abs=0.03)
    sheet = base.problem.pieces[0].sheet
    assert converted(np.array([0.123]), sheet) == 0.123  # no converter
    stepped = converted(np.array([0.26, -0.24]), type(sheet)(0.5, 1.0, 0.0, 0.0))
    np.testing.assert_array_equal(stepped, [0.5, -0.0])


@pytest.mark.slow
def test_a_campaign_has_the_records_of_the_spec_and_readings_of_its_truth(base):
    made = draw(base, Design(SEED), 3)
    assert made.problem.parameters.labels == base.problem.parameters.labels
    values = made.problem.parameters.values(jnp.asarray(made.z[None]))
    ideal = made.problem.predict(values)[0]["force"][:, 0, 0]
    gain, zero = made.sensors["force,A"]
    residual = np.asarray(made.problem.pieces[0].data[:, 0] - (1.0 + gain) * ideal - zero)
    level = float(values["noise[force,A]"][0])
    n = len(residual)
    assert np.std(residual) == pytest.approx(level, rel=4.0 / np.sqrt(2.0 * n))
    assert abs(np.mean(residual)) < 4.0 * level / np.sqrt(n)
    again = draw(base, Design(SEED), 3)
    np.testing.assert_array_equal(made.problem.pieces[0].data, again.problem.pieces[0].data)


def test_laws_are_inverted_and_moved(base):
    law = base.problem.parameters.sampled[0].prior
    np.testing.assert_allclose(standard(law, np.asarray(law.from_standard(np.array([-1.3, 0.4])))),
                               [-1.3, 0.4], atol=1e-6)  # fmt: skip
    label = base.problem.parameters.labels[0]
    there = moved(base.problem, {label: (0.5, 0.2)})
    found = there.parameters.values(jnp.full((1, there.parameters.size), 2.0))[label]
    assert float(found[0]) == pytest.approx(float(law.from_standard(0.5 + 0.2 * 2.0)), rel=1e-12)


def test_a_design_goes_through_a_job_and_back(study):
    design = Design(3, "full", "record-twice", 0.1, 2.0, {"mu": (0.5, 0.1)})
    told = json.loads(json.dumps(arguments(study.spec, design, 7)))
    spec, back, number = read_arguments(Given(told, ROOT, ROOT))
    assert (back, number) == (design, 7)
    assert spec.records[0].file == study.spec.records[0].file


@pytest.mark.slow
def test_a_sound_likelihood_passes(sound):
    assert sound.usable, sound.table()
    assert {t.name for t in sound.verdict.tested} >= {
        "M_Pl", "mu", "log-posterior", "TARP", "weight", "score"
    }  # fmt: skip
    assert sound.result["replicates"] == COUNT


@pytest.mark.slow
@pytest.mark.parametrize("how", ["noise-halved", "colour-ignored"])
def test_a_likelihood_broken_on_purpose_fails(study, how):
    found = study.validate(Replicates(COUNT, broken=how), seed=SEED, quiet=True)
    assert not found.usable
    assert found.verdict.faults
    assert all(fault.adjusted < ALPHA for fault in found.verdict.faults)
    assert how in found.table()


@pytest.mark.slow
def test_every_break_changes_the_density(base):
    made = draw(base, Design(SEED), 0)
    for how in set(BREAKS) - {"colour-ignored", "rounding-ignored"}:  # the cart has no converter
        other = broken(made.problem, how, made.z)
        z = jnp.zeros((1, other.parameters.size))
        whole = jnp.zeros((1, made.problem.parameters.size))
        assert float(other.log_posterior(z)[0]) != float(made.problem.log_posterior(whole)[0])


@pytest.mark.slow
def test_replicates_share_their_programs(study):
    given = [Given(arguments(study.spec, Design(SEED), n), ROOT, ROOT) for n in (0, 1, 2)]
    one(given[0])
    found: Counter = Counter()

    def listen(event: str, duration_secs: float, **kwargs: str | int) -> None:
        if event == COMPILED:
            found[str(kwargs.get("fun_name", "?"))] += 1

    monitoring.register_event_duration_secs_listener(listen)
    try:
        for each in given[1:]:
            one(each)
    finally:
        monitoring.unregister_event_duration_listener(listen)
    assert not found


@pytest.mark.slow
def test_a_study_goes_on_where_it_was_stopped(study, tmp_path):
    study.validate(Replicates(2), tmp_path, seed=SEED, quiet=True)
    rows = tmp_path / "validation" / "fast.jsonl"
    before = rows.read_bytes()
    rows.write_bytes(before + b'{"job": "cut sh')
    study.validate(Replicates(3), tmp_path, seed=SEED, quiet=True, resume=True)
    assert rows.read_bytes().startswith(before)
    values = [row["value"] for row in read_rows(rows)]
    assert [value["number"] for value in values] == [0, 1, 2]
    given = Given(arguments(study.spec, Design(SEED), 1), ROOT, ROOT)
    assert one(given) == values[1]
    assert (tmp_path / "index.html").is_file()
    assert json.loads((tmp_path / "validation.json").read_text("utf-8"))["usable"] is False


@pytest.mark.slow
def test_fast_and_full_fits_of_a_campaign_agree(study, tmp_path):
    study.validate(Replicates(2, fit="full"), tmp_path, seed=SEED, quiet=True)
    found = study.validate(Replicates(2), tmp_path, seed=SEED, quiet=True)
    assert found.beside is not None
    assert found.beside.campaigns == 2
    # Ranks of either are known to about 0.035 and 0.05 (ESS of 200 and 100).
    assert found.beside.greatest < 0.25, found.beside.says


def test_a_chain_takes_over_where_weights_do_not_do_and_ranks_the_same(study, monkeypatch):
    """Ranks by weighted draws and by a chain, each worth ESS: known to 0.5/sqrt(ESS)."""
    given = Given(arguments(study.spec, Design(SEED), 0), ROOT, ROOT)
    by_weights = one(given)
    monkeypatch.setattr(
        replicate, "weighted", lambda *given: dataclasses.replace(weighted(*given), pareto_k=0.9)
    )
    by_chain = one(given)
    assert by_weights["good"]
    assert by_chain["good"]
    assert (by_weights["pareto_k"] is None, by_chain["pareto_k"] is None) == (False, True)
    error = 4.0 * np.sqrt(2.0) * 0.5 / np.sqrt(ESS)  # of the largest of some 20 ranks
    own = set(study.problem.parameters.labels)  # those of sensors draw gains and zeros anew
    for name in own:
        assert by_chain["ranks"][name] == pytest.approx(by_weights["ranks"][name], abs=error), name
    known = propose(search(study.problem, 2, 1), np.random.default_rng(1))
    monkeypatch.setattr(draws, "CHAIN_STEPS", 100)
    monkeypatch.setattr(draws, "ESS", 1e6)  # more than two blocks are worth
    short = draws.chained(known, 1)
    assert not short.settled
    assert not short.good


def test_no_draw_is_weighed_where_the_law_shows_that_weights_would_not_do(study, monkeypatch):
    def refused(*_):
        raise AssertionError("draws were weighed")

    def uneven(found, rng):
        known = propose(found, rng)
        share = 0.99 * LEAST_SHARE
        return known._replace(weights=dataclasses.replace(known.weights, kish=share))

    monkeypatch.setattr(replicate, "weighted", refused)
    monkeypatch.setattr(replicate, "propose", uneven)
    row = one(Given(arguments(study.spec, Design(SEED), 0), ROOT, ROOT))
    assert row["by"] == draws.CHAIN
    assert row["pareto_k"] is None
    assert not row["good"]  # it began in a law that leaves out a part


def test_agreement_sees_ranks_that_are_off():
    fast = [
        {"campaign": str(n), "good": True, "ess": 500.0, "ranks": {"a": 0.4, "b": 0.6}}
        for n in range(20)
    ]
    full = [v | {"ranks": {"a": 0.4, "b": 0.8}} for v in fast]
    same, off = agreement(fast, fast), agreement(fast, full)
    assert same is not None
    assert off is not None
    assert same.ok
    assert not off.ok
    assert off.where == "b"
    assert agreement(fast, []) is None


@pytest.mark.slow
def test_a_misfit_shows_what_it_hurts(study):
    """A mass known to 3 % that is 2 sd off: the drag hardly feels it, the mass itself does."""
    spec = study.spec.model_copy(update={"priors": {}})
    narrow = rigid.Study(spec)
    found = narrow.validate(Replicates(6, misfit=2.0), seed=SEED, quiet=True)
    assert found.usable
    assert {one.constant for one in found.effects} == {"M_Pl"}
    own = next(one for one in found.effects if one.parameter == "M_Pl")
    assert own.error * own.expected > 0.0
    assert "prior sds off" in found.table()
    assert {one.parameter for one in first_for_each(found.effects)} <= {"mu", "noise[force,A]"}


def test_effects_of_a_shift_have_its_sign():
    rows = [
        {"ranks": {"k": 0.99 if by > 0 else 0.01}, "error": {"k": -0.5 * by},
         "shifted": {"label": "m", "by": by, "expected": {"k": -0.4 * by}}}
        for by in (2.0, -2.0)
    ]  # fmt: skip
    (found,) = effects(rows)
    assert (found.error, found.expected, found.coverage.hits) == (-1.0, -0.8, 0)


def row_of(number: int, rng: np.random.Generator, by_chain: bool, tarp: float) -> dict:
    """Row of a replicate whose forty quantities are sound."""
    named = {f"a[{i}]": float(rng.uniform()) for i in range(40)}
    ranks = named | {"log-posterior": float(rng.uniform()), "TARP": tarp}
    value = {
        "number": number, "good": True, "refused": 0, "ranks": ranks, "error": {},
        "width": dict.fromkeys(named, 0.5), "shifted": None,
        "by": "chain" if by_chain else "weights",
    }  # fmt: skip
    return {"failed": None, "value": value, "cost": {"cpu_s": 1.0}}


@pytest.mark.parametrize("missed", [False, True])
def test_what_chains_alone_miss_is_seen_among_many_quantities(missed):
    """Eight of fifteen chains with the truth outside: over all, p = 0.0014, chance among 61."""
    rng = np.random.default_rng(3)
    rows = [row_of(i, rng, False, float(rng.uniform())) for i in range(41)]
    outside = iter(rng.uniform(0.97, 1.0, 8).tolist() if missed else [])
    rows += [row_of(41 + i, rng, True, next(outside, float(rng.uniform()))) for i in range(15)]
    found = verdict(Design(1), rows)
    joint = next(check for check in found.checks if check.name == "joint")
    assert joint.ok != missed
    assert ("among the 15 replicates by chain" in joint.says) == missed
    assert all(check.ok for check in found.checks if check.name != "joint")


def test_too_few_replicates_say_so_and_failed_jobs_are_counted():
    rows = [{"failed": {"status": 1, "says": "no"}, "value": None, "cost": {"cpu_s": 1.0}}]
    found = verdict(Design(1), rows)
    assert (found.replicates, found.failed, found.usable) == (0, 1, False)
    assert "--replicates" in found.checks[0].says


@pytest.mark.parametrize("failed", [False, True])
def test_a_study_that_has_only_begun_is_not_called_unsound(failed):
    """Three sound replicates: more are wanted; one that could not be fitted is a fault."""
    rng = np.random.default_rng(4)
    rows = [row_of(i, rng, False, float(rng.uniform())) for i in range(3)]
    if failed:
        rows.append({"failed": {"says": "no"}, "value": None, "cost": {"cpu_s": 1.0}})
    shown = front(verdict(Design(1), rows), ())
    assert shown.ruling.startswith("Not sound" if failed else "Too early to say: nothing fails yet")
    assert shown.state == (BAD if failed else RESERVE)
    assert any("Widen" in line for line in shown.next) == failed
    assert "--replicates 100 --resume" in (shown.ruling if failed else shown.next[0])


@pytest.mark.parametrize(
    ("arguments_given", "says"),
    [
        (["--replicates", "0"], "number of campaigns"),
        (["--break", "everything"], "invalid choice"),
        (["--from", "nowhere.nc"], "nowhere.nc"),
    ],
)
def test_mistakes_on_the_command_line_are_told(study, arguments_given, says, tmp_path, capsys):
    given = [str(study.spec.path), "--out", str(tmp_path), "--quiet", *arguments_given]
    try:
        status = main(given)
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert says in capsys.readouterr().err


def test_a_fit_that_makes_intervals_too_narrow_is_told_from_unlucky_campaigns():
    """Errors of fifteen parameters that hang on each other, in thirty campaigns."""
    rng = np.random.default_rng(4)
    labels = [f"a[{i}]" for i in range(15)]

    def rows(narrower: float) -> list[dict]:
        made = []
        for number in range(30):
            errors = 1.2 * (0.8 * rng.standard_normal() + 0.6 * rng.standard_normal(15))
            fitted = -(errors + 0.1 * rng.standard_normal(15)) * narrower
            row = row_of(number, rng, False, float(rng.uniform()))
            row["value"]["ranks"] |= dict(zip(labels, norm.cdf(fitted).tolist(), strict=True))
            row["value"]["foretold"] = dict(zip(labels, errors.tolist(), strict=True))
            made.append(row)
        return made

    unlucky = verdict(Design(1), rows(1.0))
    assert abs(unlucky.held[0].apart) < 0.02
    assert next(c for c in unlucky.checks if c.name == "coverage").ok
    narrow = next(c for c in verdict(Design(1), rows(1.4)).checks if c.name == "coverage")
    assert not narrow.ok
    assert "too narrow" in narrow.says


def test_slopes_at_truths_are_as_long_as_the_likelihood_says(study, base):
    """Sums of 30 squared lengths against chi squared; with half the noise they are too long."""

    def lengths(how: str | None) -> tuple[float, int]:
        total, size = 0.0, 0
        for number in range(30):
            made = draw(base, Design(SEED), number)
            problem = broken(made.problem, how, made.z)
            found = score(problem, kept(problem, made.z, made.problem), made.sensors)
            total, size = total + found.length, size + found.size
        return total, size

    assert 1e-3 < chi2.cdf(*lengths(None)) < 1.0 - 1e-3
    assert chi2.sf(*lengths("noise-halved")) < 1e-6


@pytest.mark.slow
def test_the_slope_at_a_truth_foretells_how_far_off_a_fit_is(sound, base):
    for value in (one(Given(arguments(base.spec, Design(SEED), n), ROOT, ROOT)) for n in (0, 1)):
        for label, told in value["foretold"].items():
            # To first order: the curvature of priors and drag changes a step by a tenth or so.
            assert value["error"][label] == pytest.approx(told, abs=0.25 + 0.15 * abs(told)), label


def test_a_law_that_misses_the_place_of_truths_is_seen_by_their_weight():
    rng = np.random.default_rng(8)
    rows = [row_of(i, rng, False, float(rng.uniform())) for i in range(40)]
    for row in rows:
        row["value"]["ranks"]["weight"] = float(rng.uniform(0.6, 1.0))
    joint = next(check for check in verdict(Design(1), rows).checks if check.name == "joint")
    assert not joint.ok
    assert "weight: draws come too rarely where truths lie" in joint.says


@pytest.mark.slow
def test_slopes_alone_are_a_study_of_their_own(study, tmp_path):
    asked = Replicates(COUNT, fit="slopes")
    found = study.validate(asked, tmp_path, seed=SEED, quiet=True)
    assert found.usable, found.table()
    assert [t.name for t in found.verdict.tested] == ["score"]
    assert (tmp_path / "index.html").is_file()
    assert (tmp_path / "validation" / "slopes.jsonl").is_file()
    bad = study.validate(dataclasses.replace(asked, broken="noise-halved"), seed=SEED, quiet=True)
    assert not bad.usable
    assert "surer than its campaigns allow" in bad.table()
    with pytest.raises(InputError, match="leave them out"):
        Replicates(2, fit="slopes", misfit=2.0)
