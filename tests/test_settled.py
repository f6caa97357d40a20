"""An optimum is one: flat, near its priors, and never below that of a model which it holds."""

import dataclasses

import numpy as np
import pytest
from test_screening import CHOICE, campaign, fitted
from test_shown import bare

from rigid.discovery.outcome import Judged
from rigid.discovery.refit import Refit, lead_of
from rigid.discovery.weighing.discrepancy import borne
from rigid.discovery.workflow import WIDENED, refusal
from rigid.effects import CATALOGUE
from rigid.inference.search import search
from rigid.inference.settled import AWAY, CHANCE, away_from_top, settled
from rigid.localfit.ascent import given_up, refined
from rigid.localfit.candidates import Candidate
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import holding
from rigid.localfit.hypothesis import widened
from rigid.localfit.leave_one_out import HeldOut
from rigid.localfit.local import LocalFit
from rigid.localfit.settled import another_law, below, labels_of, nearer_priors, state_of, unsettled
from rigid.report.usability import optimum


@pytest.fixture(scope="module")
def clean() -> tuple[LocalFit, tuple]:
    return fitted(campaign(400))


def moved(local: LocalFit, by: np.ndarray) -> LocalFit:
    """The same model elsewhere."""
    return expanded(local.family, Point.beside(local, local.w + by))


@pytest.mark.slow
def test_a_fit_of_a_right_model_is_settled(clean):
    local, _ = clean
    assert state_of(local).ok
    assert unsettled(local) == ""
    assert optimum(state_of(local)).ok
    assert nearer_priors(local) == []


@pytest.mark.slow
def test_a_fit_that_stopped_on_its_way_is_not(clean):
    """A posterior sd along an axis is a posterior sd away, and half of the limit is none."""
    local, _ = clean
    axis = np.eye(len(local.w))[0] / np.sqrt(local.information[0, 0])
    assert state_of(moved(local, axis)).away == pytest.approx(1.0, abs=0.3)
    assert not state_of(moved(local, axis)).flat
    assert state_of(moved(local, 0.5 * AWAY * axis)).flat
    assert "posterior sds from the optimum" in unsettled(moved(local, axis))


@pytest.mark.slow
def test_a_number_far_from_its_prior_is_told_first():
    """Readings of three times the flow that the prior knows to a fifth: ln 3 / ln 1.2 = 6 sds."""
    problem = campaign(401, **{"kappa[free-run-1,A]": 0.6})
    local, _ = fitted(problem)
    found = state_of(local)
    assert found.flat
    assert not found.ok
    label, sds = found.far[0]
    assert label == "kappa[free-run-1,A]"
    assert sds == pytest.approx(np.log(3.0) / np.log(1.2), abs=0.2)
    assert unsettled(local).startswith("kappa[free-run-1,A] is 6.0 prior sds above its prior")
    assert not optimum(found).ok
    # Of a law that explains hundreds of nats eighteen may be its discrepancy, here and in a refit.
    spent = 0.5 * sds**2
    assert state_of(local, 0.99 * spent).far == found.far
    borne_it = state_of(local, 1.01 * spent)
    assert (borne_it.ok, borne_it.far, borne_it.driven) == (True, (), found.far)
    assert optimum(borne_it).ok
    assert "prior sds above its prior: a law that is not exact drives this" in borne_it.says
    assert unsettled(local, borne=1.01 * spent) == ""
    one = Refit(bare(Candidate, effect=CHOICE[0]), local, local, 0.99 * spent / borne(1.0))
    assert one.unsettled
    assert dataclasses.replace(one, earlier=0.02 * one.log_bayes).unsettled == ""
    alone, centre = nearer_priors(local)
    at = labels_of(local.hypothesis).index("kappa[free-run-1,A]")
    assert (alone[at], np.delete(alone, at)) == (0.0, pytest.approx(np.delete(local.w, at)))
    assert not centre.any()


@pytest.mark.slow
def test_a_refit_below_the_fit_that_it_holds_is_not_settled(clean):
    local, programs = clean
    effect = CHOICE[0]
    family = holding(programs, (effect,))
    w = widened(local.hypothesis, local.w, [2.0])
    begun = expanded(family, Point(local.hypothesis.plus(effect), local.layout, w, local.z_noise))
    assert below(begun, local)
    assert "below the one without" in unsettled(begun, local)
    assert not below(refined(begun), local)
    assert unsettled(refined(begun), local) == ""
    one = Refit(bare(Candidate, effect=effect), local, begun, 0.0)
    assert "not settled" in refusal(one, judged())
    assert refusal(dataclasses.replace(one, after=refined(begun)), judged()) == ""


@pytest.mark.slow
def test_a_fit_far_below_a_rival_is_given_up_and_no_other(clean):
    """What its model promises it may still gain twice over, and with that reach the rival."""
    local, programs = clean
    effect = CHOICE[0]
    family = holding(programs, (effect,))
    w = widened(local.hypothesis, local.w + 0.3, [2.0])
    begun = expanded(family, Point(local.hypothesis.plus(effect), local.layout, w, local.z_noise))
    end = refined(begun)
    assert end.value > begun.value + 100.0
    assert refined(begun, rival=end.value).value == end.value
    assert not given_up(begun, end.value)
    hopeless = refined(begun, rival=end.value + 1e7)
    assert given_up(hopeless, end.value + 1e7)
    assert hopeless.value < end.value
    nowhere = dataclasses.replace(begun, design=np.full_like(begun.design, np.nan))
    assert not given_up(nowhere, end.value)
    lead = lead_of("other", Refit(bare(Candidate, effect=effect), local, end, 0.0))
    assert lead == ("other", end.value)


def judged(gap: float = 1.0, gain: float = 5.0) -> Judged:
    """What became of a gap of 1.0 and of two left-out parts when an effect was added."""
    sure = np.zeros(2, dtype=bool)
    left = HeldOut(np.zeros(2), sure), HeldOut(np.full(2, 0.5 * gain), sure)
    return Judged((1.0, gap), (1.0, gap), left)


@pytest.mark.slow
def test_what_widens_the_gap_or_predicts_worse_is_not_named(clean):
    local, _ = clean
    one = Refit(bare(Candidate, effect=CHOICE[0]), local, local, 50.0)
    assert refusal(one, judged()) == ""
    assert refusal(one, judged(gap=1.0 + 0.5 * WIDENED)) == ""
    assert "from 1.0000 to 1.0600" in refusal(one, judged(gap=1.06))
    assert "predicted worse" in refusal(one, judged(gain=-0.3))


@pytest.mark.slow
def test_a_search_tells_whether_its_best_optimum_is_one():
    """Of a right model it is; on a slope, or far from a prior, it is not."""
    problem = campaign(402)
    good = search(problem, 2, 1)
    assert good.settled.ok
    stopped = dataclasses.replace(good.optima[0], away=3.0)
    assert "3.0 posterior sds" in dataclasses.replace(good, optima=(stopped,)).settled.why
    wrong = search(campaign(403, **{"kappa[free-run-1,A]": 0.6}), 2, 1)
    assert wrong.settled.far[0][0] == "kappa[free-run-1,A]"


@pytest.mark.slow
def test_where_an_effects_own_amplitude_ends_is_left_to_who_weighs_it(clean):
    local, programs = clean
    effect = CHOICE[0]
    family = holding(programs, (effect,))
    more = widened(local.hypothesis, local.w, [-9.0])
    far = expanded(family, Point(local.hypothesis.plus(effect), local.layout, more, local.z_noise))
    assert state_of(far).far == ()
    assert not state_of(far).flat  # the prior alone leads back


@pytest.mark.slow
@pytest.mark.parametrize(("sds", "said"), [(6.0, ("q_fittings",)), (-6.0, ()), (3.0, ())])
def test_a_law_whose_width_is_far_above_its_prior_is_another_however_much_it_explains(
    clean, sds, said
):
    local, programs = clean
    effect = CATALOGUE["hose-pressure-drop"]
    hypothesis = local.hypothesis.plus(effect)
    own = [sds if p.label == "q_fittings" else 0.0 for p in hypothesis.brought_by(effect)]
    w = widened(local.hypothesis, local.w, own)
    at = Point(hypothesis, local.layout, w, local.z_noise)
    there = expanded(holding(programs, (effect,)), at)
    assert tuple(label for label, _ in another_law(there, effect)) == said
    assert tuple(label for label, _ in state_of(there, borne=1e9).far) == said


@pytest.mark.slow
def test_an_effect_is_not_another_law_for_what_one_before_it_does(clean):
    local, programs = clean
    first, second = CATALOGUE["hose-pressure-drop"], CATALOGUE["piston-leakage"]
    hypothesis = local.hypothesis.plus(first)
    own = [6.0 if p.label == "q_fittings" else 0.0 for p in hypothesis.brought_by(first)]
    w = widened(local.hypothesis, local.w, own)
    both = hypothesis.plus(second)
    w = widened(hypothesis, w, [0.0 for _ in both.brought_by(second)])
    at = Point(both, local.layout, w, local.z_noise)
    there = expanded(holding(programs, (first, second)), at)
    assert another_law(there, second) == ()
    assert [label for label, _ in another_law(there, first)] == ["q_fittings"]
    assert [label for label, _ in state_of(there).far] == ["q_fittings"]


def test_the_limit_is_passed_by_chance_as_rarely_as_it_says():
    """A tenth of the draws of 50,000 right models would be too many to be told from CHANCE."""
    rng, n, size = np.random.default_rng(5), 50_000, 20
    limit = settled([str(i) for i in range(size)], np.zeros(size), 0.0).limit
    far = np.sum(np.abs(rng.standard_normal((n, size))).max(axis=1) > limit)
    assert abs(far - n * CHANCE) < 4.0 * np.sqrt(n * CHANCE)  # Poisson, 4 sds
    spread = np.abs(1.5 * rng.standard_normal((n, size))).max(axis=1) > limit  # a wrong prior
    assert spread.sum() > 10 * n * CHANCE


@pytest.mark.slow
def test_a_bound_on_every_number(clean):
    """No entry of the step is longer, in its posterior sd, than what is told."""
    local, _ = clean
    g = np.random.default_rng(1).standard_normal(len(local.w))
    step = local.covariance @ g
    sds = np.abs(step) / np.sqrt(np.diag(local.covariance))
    assert sds.max() <= away_from_top(g, local.information)


@pytest.mark.parametrize("entry", [-1.0, np.nan])
def test_information_of_no_maximum_is_infinitely_far_from_one(entry):
    """Where slopes grow without bound, or are no numbers, the search does not end in an error."""
    assert away_from_top(np.ones(2), np.diag([1.0, entry])) == np.inf
    assert away_from_top(np.ones(2), np.diag([1.0, 4.0])) == pytest.approx(np.sqrt(1.25))
    assert settled(["a", "b"], np.zeros(2), np.inf).why
