"""An effect that an early turn passed over takes the place of one that stood for it."""

import dataclasses

import pytest
from test_screening import CHOICE, campaign, fitted, found_in

from rigid.discovery.fitted import Fitted
from rigid.discovery.refit import NO_LEAD, Lead, contained, lead_of
from rigid.discovery.rivals import fitted_in_full
from rigid.discovery.signatures import laid_out
from rigid.discovery.turn import Running, Turn
from rigid.discovery.workflow import ahead_of_an_earlier
from rigid.effects import CATALOGUE
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.report.discovery.lead import other_laws

HIDDEN, STANDS_FOR_IT = "hose-pressure-drop", "clock-offset"


@pytest.fixture(scope="module")
def found():
    return found_in(campaign(302, R_hose=4e9))


def added_in_turn(found, first, second, shelf=NOTHING_KEPT):
    """Turns and steps as if two effects had been added one after the other."""
    fit = Fitted(found.base, found.programs)
    turn = Turn(fit, laid_out(fit, CHOICE, NOTHING_KEPT), Running(0, shelf=shelf))
    turns, steps = [], []
    for name in (first, second):
        refits = turn.refits([name])
        turns.append(turn)
        steps.append(dataclasses.replace(found.steps[0], refits=refits, chosen=name))
        turn = turn.after(refits[name])
    return turns, steps


@pytest.mark.slow
def test_what_was_added_last_is_tried_in_the_place_of_what_came_before_it(found):
    turns, steps = added_in_turn(found, STANDS_FOR_IT, HIDDEN)
    number, refits = ahead_of_an_earlier(turns, steps)
    assert number == 0
    assert set(refits) == {STANDS_FOR_IT, HIDDEN}
    assert refits[HIDDEN].log_bayes > refits[STANDS_FOR_IT].log_bayes
    whole = found.steps[0].refits[HIDDEN]
    assert refits[HIDDEN].log_bayes == pytest.approx(whole.log_bayes, abs=0.5)
    assert refits[HIDDEN].before.hypothesis == found.base.hypothesis


@pytest.mark.slow
def test_what_explains_less_does_not_take_the_place_and_what_was_fitted_is_not_tried_again(found):
    turns, steps = added_in_turn(found, HIDDEN, STANDS_FOR_IT)
    assert ahead_of_an_earlier(turns, steps) == (0, {})
    turns, steps = added_in_turn(found, STANDS_FOR_IT, HIDDEN)
    known = dataclasses.replace(steps[0], refits=steps[0].refits | steps[1].refits)
    assert ahead_of_an_earlier(turns, [known, steps[1]]) == (0, {})


@pytest.mark.slow
def test_what_was_given_up_is_tried_again_once_it_was_added_behind_what_it_was_given_up_for(found):
    turns, steps = added_in_turn(found, STANDS_FOR_IT, HIDDEN)
    short = dataclasses.replace(steps[1].refits[HIDDEN], log_bayes=-3.0, ahead=STANDS_FOR_IT)
    known = dataclasses.replace(steps[0], refits=steps[0].refits | {HIDDEN: short})
    number, refits = ahead_of_an_earlier(turns, [known, steps[1]])
    assert number == 0
    assert refits[HIDDEN].log_bayes > refits[STANDS_FOR_IT].log_bayes
    assert refits[HIDDEN].ahead == ""


@pytest.mark.slow
def test_what_explains_most_as_another_law_only_is_no_rival(found):
    """It counts for nothing, gives no lead, and the page says so."""
    fit = Fitted(found.base, found.programs)
    turn = Turn(fit, laid_out(fit, CHOICE, NOTHING_KEPT), Running(0))
    said, refits = fitted_in_full(turn, {})
    assert said.probability[HIDDEN] > 0.8
    far = dataclasses.replace(refits[HIDDEN])
    vars(far)["another"] = "q_fittings is 6.0 prior sds above its prior"
    said, refits = fitted_in_full(turn, refits | {HIDDEN: far})
    assert said.probability[HIDDEN] < 0.01
    assert lead_of(HIDDEN, far) == NO_LEAD
    step = dataclasses.replace(found.steps[0], said=said, refits=refits, chosen=None)
    (told,) = other_laws(step)
    assert HIDDEN in told
    assert "6.0 prior sds" in told


@pytest.mark.slow
def test_a_kept_fit_is_read_back_beside_the_effects_that_it_was_made_with_alone(found, tmp_path):
    """A turn that is decided again has other effects in it, and as many."""
    third = "load-cell-drift"
    kept = Shelf(tmp_path, reads=True)
    beside = [added_in_turn(found, first, third, kept)[1][1] for first in (STANDS_FOR_IT, HIDDEN)]
    inside = [step.refits[third].after.hypothesis.added[0].name for step in beside]
    assert inside == [STANDS_FOR_IT, HIDDEN]
    values = [step.refits[third].after.value for step in beside]
    assert values[1] > values[0] + 5.0
    assert len(list(tmp_path.glob("discovery-refit-*"))) == 4


@pytest.mark.slow
def test_a_run_that_goes_on_reads_what_was_given_up_and_what_was_then_led_to_its_end(
    found, tmp_path
):
    fit = Fitted(found.base, found.programs)
    bench = laid_out(fit, CHOICE, NOTHING_KEPT)
    lead = Lead(HIDDEN, found.steps[0].refits[HIDDEN].after.value + 1e6)

    def both(shelf):
        turn = Turn(fit, bench, Running(0, shelf=shelf))
        given_up = turn.refits([STANDS_FOR_IT], lead)[STANDS_FOR_IT]
        whole = turn.refits([STANDS_FOR_IT])[STANDS_FOR_IT]
        return given_up.after.value, whole.after.value

    first, again = both(Shelf(tmp_path)), both(Shelf(tmp_path, reads=True))
    assert again == first
    assert len(list(tmp_path.glob("discovery-refit-*"))) == 2


@pytest.mark.slow
def test_a_law_that_the_likeliest_contains_is_fitted_again_from_there():
    """How far it is behind must not say where its first fit ended."""
    inner, outer = "coulomb-friction", "stribeck-friction"
    choice = (CATALOGUE[inner], CATALOGUE[outer])
    local, programs = fitted(campaign(303, choice[:1], F_C=400.0, presliding=1e-5), choice)
    fit = Fitted(local, programs)
    turn = Turn(fit, laid_out(fit, choice, NOTHING_KEPT), Running(0))
    refits = turn.refits([inner, outer])
    short = dataclasses.replace(refits[inner], log_bayes=3.0, ahead=outer)
    assert contained(refits | {inner: short}, outer) == [inner]
    assert contained(refits | {inner: short}, inner) == []
    said, led = fitted_in_full(turn, {outer: refits[outer], inner: short})
    assert led[inner].ahead == ""
    assert led[inner].log_bayes == pytest.approx(refits[inner].log_bayes, abs=0.5)
    assert said.probability[inner] > 0.3
