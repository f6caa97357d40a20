"""Two effects at once: their Bayes factor, and what it does to what is said of each."""

import dataclasses

import numpy as np
import pytest

from rigid.discovery.rivals import changed, unsure_twins
from rigid.discovery.unmodelled.inputs import Input
from rigid.discovery.weighing.explain import NOTHING, UNNAMED, Explained, bundles_of
from rigid.discovery.weighing.odds import odds
from rigid.discovery.weighing.pairs import UNSURE, doubted, pairs
from rigid.effects import CATALOGUE
from rigid.likelihood.priors import AbstractPrior, Lognormal, Normal
from rigid.localfit.candidates import Candidate
from rigid.localfit.evidence import LOG_MASS, amplitudes, log_bayes
from rigid.localfit.screening import Screening

LAWS: tuple[tuple[str, AbstractPrior], ...] = (
    ("piston-leakage", Lognormal(2.0, 2.0)),
    ("hose-pressure-drop", Normal(0.0, 3.0)),
    ("clock-offset", Normal(0.0, 1.0)),
)


def explained(slope: np.ndarray, information: np.ndarray, bumps: int = 0) -> Explained:
    """What is left over, with one candidate for each of LAWS and hidden bumps after them."""
    listed = tuple(Candidate(CATALOGUE[name], "a", 0.0, law, {}) for name, law in LAWS)
    candidate = np.array(
        [
            float(log_bayes(slope[i], information[i, i], amplitudes(law, 0.0)))
            for i, (_, law) in enumerate(LAWS)
        ]
    )
    hidden = (Input("force", "speed"),) * max(bumps, 1)
    bundles = bundles_of(hidden, len(LAWS) if bumps else 0, information)
    bundle = np.array([float(b.log_bayes(slope)) for _, b in bundles])
    return Explained(listed, Screening(slope, information), candidate, bundles, bundle, np.zeros(0))


def information(cosine: float) -> np.ndarray:
    """Of three amplitudes; the traces of the first two have this cosine."""
    alike = np.eye(3)
    alike[0, 1] = alike[1, 0] = cosine
    size = np.array([4.0, 3.0, 5.0])
    return alike * np.outer(size, size)


@pytest.mark.parametrize("cosine", [-0.9, 0.0, 0.6])
def test_the_bayes_factor_of_a_pair_is_its_double_integral(cosine: float):
    known = information(cosine)
    slope = known @ np.array([2.2, -1.5, 0.0])
    found = pairs(explained(slope, known))
    first, second = (amplitudes(law, 0.0)[:, None] for _, law in LAWS[:2])
    second = second.T
    exponent = (
        slope[0] * first + slope[1] * second - 0.5 * known[0, 0] * first**2
        - known[0, 1] * first * second - 0.5 * known[1, 1] * second**2
    )  # fmt: skip
    exact = np.logaddexp.reduce((exponent + LOG_MASS[:, None] + LOG_MASS).ravel())
    assert found.names == tuple(name for name, _ in LAWS)
    # Linear between strengths a quarter apart: a parabola is off by 1/8 of the square at most.
    assert found.log_bayes[0, 1] == pytest.approx(exact, abs=0.25**2 / 8.0 + 1e-3)
    assert found.log_bayes[1, 0] == found.log_bayes[0, 1]
    assert np.all(np.isneginf(np.diag(found.log_bayes)))


def test_two_effects_are_named_where_neither_alone_explains_as_much_as_something_hidden():
    """Ten bumps that span both traces beat either effect alone; the pair beats them."""
    traces = np.zeros((12, 13))
    traces[:3, :3] = np.diag([4.0, 3.0, 5.0])
    traces[:10, 3:] = np.random.default_rng(7).standard_normal((10, 10))
    slope = traces.T @ (traces[:, :3] @ np.array([2.0, 2.7, 0.0]))
    left = explained(slope, traces.T @ traces, bumps=10)
    alone, together = odds(left), odds(left, both=pairs(left))
    assert alone.probability[UNNAMED] > 0.5
    assert together.probability[UNNAMED] < 0.1
    for said in (alone, together):
        assert sum(said.probability.values()) == pytest.approx(1.0)
        assert said.nothing == said.probability[NOTHING]
    assert together.evidence["piston-leakage"] > alone.evidence["piston-leakage"] + 5.0


def test_pairs_take_little_from_a_single_effect():
    """One effect at a strength of 8 keeps nearly all of its probability."""
    known = information(0.3)
    slope = known @ np.array([2.0, 0.0, 0.0])
    left = explained(slope, known)
    alone, together = odds(left), odds(left, both=pairs(left))
    name = LAWS[0][0]
    assert together.probability[name] == pytest.approx(alone.probability[name], abs=0.02)


def test_odds_of_what_explains_alike_are_their_priors():
    left = explained(np.zeros(3), np.eye(3))
    left = dataclasses.replace(left, candidate=np.zeros(3), bundle=np.zeros(1))
    assert odds(left).probability == pytest.approx(
        {NOTHING: 0.4, UNNAMED: 0.15} | {name: 0.45 / 3 for name, _ in LAWS}, rel=1e-6
    )


def test_of_effects_with_one_trace_one_fit_stands_for_all():
    known = information(0.99)
    slope = known @ np.array([2.0, 0.0, 0.0])
    left = explained(slope, known)
    changes = changed(left, {LAWS[0][0]: left.effects[LAWS[0][0]] - 1.5})
    assert changes == {LAWS[0][0]: pytest.approx(-1.5), LAWS[1][0]: pytest.approx(-1.5)}
    before, after = odds(left), odds(left, changes)
    shift = {name: after.evidence[name] - before.evidence[name] for name, _ in LAWS}
    assert shift == {
        LAWS[0][0]: pytest.approx(-1.5),
        LAWS[1][0]: pytest.approx(-1.5),
        LAWS[2][0]: 0,
    }


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_twins_that_are_less_behind_than_a_fit_has_changed_are_fitted_too(sign: float):
    """Signatures are of small amplitudes: which twin a large one is they do not tell."""
    known = information(0.99)
    left = explained(known @ np.array([8.0, 0.0, 0.0]), known)
    first, twin, other = (name for name, _ in LAWS)
    behind = left.effects[first] - left.effects[twin]
    assert behind > UNSURE

    def fitted(name: str, change: float) -> dict[str, float]:
        return {name: left.effects[name] + change}

    little, much = (fitted(first, sign * share * behind) for share in (0.9, 1.1))
    assert unsure_twins(left, little, first) == []
    assert unsure_twins(left, much, first) == [twin]
    assert unsure_twins(left, much | fitted(twin, 0.0), first) == []
    assert unsure_twins(left, fitted(twin, 0.9 * UNSURE), twin) == []
    assert unsure_twins(left, fitted(twin, sign * 1.1 * UNSURE), twin) == [first]
    assert unsure_twins(left, fitted(other, 100.0), other) == []


@pytest.mark.parametrize(("cosine", "share"), [(0.0, 1.0), (0.999, 0.0)])
def test_a_pair_takes_over_from_full_fits_what_each_effect_explains_of_its_own(cosine, share):
    known = information(cosine)
    both = 5.0 * share * np.array([0.0, 1.0, 0.0])
    left = explained(known @ (np.array([5.0, 0.0, 0.0]) + both), known)
    before = pairs(left)
    after = before.corrected(left.effects, {LAWS[0][0]: 100.0, LAWS[1][0]: 40.0})
    change = after.log_bayes[0, 1] - before.log_bayes[0, 1]
    assert change == pytest.approx(100.0 + 40.0 * share, abs=1.0)
    assert after.log_bayes[1, 0] == after.log_bayes[0, 1]
    np.testing.assert_allclose(after.log_bayes[:2, 2] - before.log_bayes[:2, 2], [100.0, 40.0])


@pytest.mark.parametrize("change", [4.0, -20.0, 60.0, 300.0])
def test_a_pair_is_ahead_by_what_fits_in_full_have_not_put_in_doubt(change: float):
    """A change of UNSURE nats is none; what is more is taken from the lead, down to nothing."""
    known = information(0.0)
    left = explained(known @ np.array([4.0, 4.0, 0.0]), known)
    names = [name for name, _ in LAWS]
    before = pairs(left)
    after = before.corrected(left.effects, {names[0]: change})
    single = left.effects | {names[0]: left.effects[names[0]] + change}
    better = max(single[name] for name in names[:2])
    lead = after.log_bayes[0, 1] - better
    assert lead > 60.0
    then = doubted(before, after, single)
    less = max(abs(change) - UNSURE, 0.0)
    assert then.log_bayes[0, 1] - better == pytest.approx(max(lead - less, 0.0), abs=0.1)
    assert then.log_bayes[1, 0] == then.log_bayes[0, 1]
    assert np.all(np.isneginf(np.diag(then.log_bayes)))
    np.testing.assert_array_equal(doubted(before, before, left.effects).log_bayes, before.log_bayes)


def test_a_pair_counts_for_what_is_surely_missing_first():
    """The first two have one trace and share what speaks for it; the third is weaker but apart."""
    known = information(0.999)
    left = explained(known @ np.array([6.0, 0.0, 1.0]), known)
    said = odds(left, both=pairs(left)).probability
    first, twin, apart = (said[name] for name, _ in LAWS)
    assert first + twin > 0.95 * (1.0 - said[UNNAMED])
    assert apart < 0.05


def test_what_looks_like_an_effect_may_be_something_that_has_no_entry():
    """To ten that are the effect one mimics it: 0.3 of 0.15 that have no entry, to 0.45 that do."""
    known = information(0.3)
    left = explained(known @ np.array([20.0, 0.0, 0.0]), known)
    said = odds(dataclasses.replace(left, bundle=np.full(1, -50.0))).probability
    assert said[LAWS[0][0]] == pytest.approx(1.0 / 1.1, abs=1e-3)
    assert said[UNNAMED] == pytest.approx(0.1 / 1.1, abs=1e-3)
