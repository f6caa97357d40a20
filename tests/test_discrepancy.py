"""The discrepancy of a law: what it does to the odds of effects, and of a second one."""

import dataclasses

import numpy as np
import pytest

from rigid.discovery.weighing import discrepancy
from rigid.discovery.weighing.discrepancy import (
    FACTOR,
    PAID,
    TYPICAL,
    in_another_form,
    moderated,
    of_another,
    of_the_law,
)
from rigid.discovery.weighing.explain import NOTHING, UNNAMED
from rigid.discovery.weighing.odds import Odds
from rigid.discovery.workflow import most_left

SURE = 1.0 / 1.1


def said(evidence: dict[str, float]) -> Odds:
    """Odds of effects by their evidence alone, one in eleven of all being something unnamed."""
    top = max(evidence.values())
    weight = {name: np.exp(log - top) for name, log in evidence.items()}
    total = sum(weight.values())
    chance = {name: SURE * float(w / total) for name, w in weight.items()}
    return of({NOTHING: 0.0, UNNAMED: 1.0 - SURE, **chance}, evidence)


def of(chance: dict[str, float], evidence: dict[str, float]) -> Odds:
    """Odds of stated probabilities."""
    with np.errstate(divide="ignore"):
        return Odds({name: float(np.log(p)) for name, p in chance.items()}, evidence, 0.0)


def test_the_densities_of_shares_are_of_the_stated_middle_and_factor():
    """A density over the logarithm; what is below the typical share counts as that."""
    log = np.linspace(np.log(TYPICAL), np.log(TYPICAL) + 8.0 * np.log(FACTOR), 20_001)
    assert np.trapezoid(of_the_law(np.exp(log)), log) == pytest.approx(0.5, abs=1e-4)
    at, above = of_the_law(TYPICAL), of_the_law(TYPICAL * FACTOR)
    assert above / at == pytest.approx(np.exp(-0.5))
    assert of_the_law(0.0) == at
    assert of_another(1.0) / of_another(10.0) == pytest.approx(np.exp(0.5))


def beside(first: Odds, before: float, hidden: float) -> Odds:
    """The same once something was added, with what speaks for something unnamed."""
    return discrepancy.beside(dataclasses.replace(first, unnamed=hidden), before)


@pytest.mark.parametrize(
    ("share", "least", "most"), [(0.02, 0.1, 0.2), (0.1, 0.3, 0.4), (0.3, 0.6, 0.8), (1.0, 0.89, 1)]
)
def test_a_second_effect_has_to_explain_more_than_the_law_of_the_first_may_leave(
    share: float, least: float, most: float
):
    before = 2000.0
    first = said({"clock-offset": share * before, "return-spring": 1.0})
    then = beside(first, before, share * before)
    assert least < then.probability["clock-offset"] < most
    assert sum(then.probability.values()) == pytest.approx(1.0)
    assert then.probability[UNNAMED] > then.form
    # Alone, the form is to the effect as their densities: an even bet beforehand.
    odds = then.form / then.probability["clock-offset"]
    assert odds == pytest.approx(of_the_law(share) / of_another(share), rel=1e-3)


def test_few_nats_may_be_a_discrepancy_that_no_unmodelled_cause_can_see():
    """A change of a pump's stage, 3,865 nats, whose form left 7.6 to a valve event: 0.89 of it."""
    first = said({"valve-event": 7.6, "return-spring": -3.0})
    kept = beside(first, 3865.0, -1.5).probability["valve-event"]
    law, another = of_the_law(TYPICAL), of_another(TYPICAL)
    of_those = another / (law + another)
    assert kept == pytest.approx(SURE * of_those, rel=1e-3)
    assert kept < 0.4
    more = said({"valve-event": PAID + 5.0, "return-spring": -3.0})
    assert beside(more, 3865.0, -1.5).probability["valve-event"] == pytest.approx(SURE, rel=1e-3)


def test_what_no_unmodelled_cause_sees_is_no_discrepancy():
    """Measured friction of a seal: 328 nats beside 1,137, of which hidden forces see 1.3."""
    first = said({"pressure-dependent-friction": 328.4, "coulomb-friction": 1.0})
    kept = [
        beside(first, 1136.5, hidden).probability["pressure-dependent-friction"]
        for hidden in (-1.0, 1.3, 164.2, 328.4, 1000.0)
    ]
    assert kept[0] == pytest.approx(SURE)
    assert kept[1] > 0.9
    assert kept[3] == pytest.approx(kept[4])
    assert kept[3] < 0.75
    assert kept == sorted(kept, reverse=True)


def test_nothing_keeps_its_probability():
    """What is left may be nothing at all: that is told from anything by the evidence alone."""
    first = of(
        {NOTHING: 0.6, UNNAMED: 0.1, "valve-event": 0.2, "clock-offset": 0.1},
        {"valve-event": -0.5, "clock-offset": -1.2},
    )
    for then in (beside(first, 1000.0, 1.0), moderated(first, 2.0)):
        assert then.nothing == pytest.approx(0.6)
        assert sum(then.probability.values()) == pytest.approx(1.0)


def test_a_first_effect_has_nothing_before_it():
    first = said({"clock-offset": 100.0, "return-spring": 1.0})
    assert discrepancy.beside(first, 0.0) is first


def test_odds_are_those_of_exact_laws_where_nothing_is_left():
    first = said({"valve-event": 251.4, "pump-stage-switch": 254.9})
    assert moderated(first, 0.0) is first


def test_few_nats_of_many_do_not_part_two_effects_that_both_leave_some():
    """Second simulator, `valve-ramp`, development seed 910001: 3.5 nats of 255, 10 left."""
    first = said({"valve-event": 251.4, "pump-stage-switch": 254.9, "return-spring": 1.0})
    then = moderated(first, 10.4)
    assert first.probability["pump-stage-switch"] > 0.88
    assert then.probability["pump-stage-switch"] < 0.7
    assert then.probability["valve-event"] > 0.2
    assert then.probability["return-spring"] < 1e-6  # it leaves nearly all
    assert sum(then.probability.values()) == pytest.approx(1.0)


def test_what_leaves_as_much_as_it_explains_is_not_sure_to_be_the_effect():
    """Second simulator, population free-root, seed 930001: 14 nats explained, 14 left."""
    first = said({"accelerometer-resonance": 14.4, "return-spring": -1.0})
    then = moderated(first, 14.0)
    assert 0.8 < then.probability["accelerometer-resonance"] < 0.88
    little = moderated(first, 0.1)
    assert little.probability[UNNAMED] == pytest.approx(1.0 - SURE)


def test_what_explains_nothing_at_all_has_no_part():
    """An evidence of minus infinity, and a turn at which no effect is left to be weighed."""
    first = said({"clock-offset": 100.0, "return-spring": -np.inf})
    then = moderated(beside(first, 300.0, 50.0), 20.0)
    assert then.probability["return-spring"] == 0.0
    assert sum(then.probability.values()) == pytest.approx(1.0)
    alone = Odds({NOTHING: np.log(0.01), UNNAMED: np.log(0.99)}, {}, 7.0)
    for then in (beside(alone, 300.0, 50.0), moderated(alone, 50.0)):
        assert then.probability == pytest.approx(alone.probability)
    assert most_left(alone) == pytest.approx(7.0)


def test_a_discrepancy_of_three_directions_lies_in_one_by_chance_as_often_as_reckoned():
    way = np.random.default_rng(21).standard_normal((40_000, 3))
    taken = way[:, 0] ** 2 / np.sum(way**2, axis=1)
    for share in (0.05, 0.3, 0.8):
        often, foretold = np.mean(taken > share), 1.0 - np.sqrt(share)
        assert often == pytest.approx(foretold, abs=4.0 * np.sqrt(0.25 / len(way)))


def test_moderated_odds_foretell_better_where_laws_have_discrepancies():
    """Two laws of cosine 0.95, 400 nats, the first the right one; its form is off as they are.

    Of what exact laws state at 0.9 one in ten is wrong, of moderated odds 2 % at most, and they are
    right as often as they say.
    """
    rng = np.random.default_rng(8)
    cosine, nats = 0.95, 400.0
    other = np.array([cosine, np.sqrt(1.0 - cosine**2), 0.0, 0.0])
    chance: dict[str, list[float]] = {"exact": [], "moderated": []}
    stated: dict[str, list[bool]] = {"exact": [], "moderated": []}
    for share in TYPICAL * FACTOR ** rng.standard_normal(4000):
        way = rng.standard_normal(3)
        off = min(share, 0.9)
        cause = np.array([np.sqrt(1.0 - off), *(np.sqrt(off) * way / np.linalg.norm(way))])
        reading = np.sqrt(2.0 * nats) * cause + rng.standard_normal(4)
        logs = {"right": 0.5 * reading[0] ** 2, "wrong": 0.5 * float(reading @ other) ** 2}
        exact = said(logs)
        left = 0.5 * float(reading @ reading) - max(logs.values())
        for how, odds in (("exact", exact), ("moderated", moderated(exact, left))):
            right, wrong = (odds.probability[name] for name in logs)
            chance[how].append(right / (right + wrong))
            if max(right, wrong) >= 0.9:
                stated[how].append(wrong > right)
    exact, then = (np.array(chance[how]) for how in ("exact", "moderated"))
    assert np.mean(stated["exact"]) > 0.08
    assert np.mean(stated["moderated"]) < 0.02
    assert np.mean(np.log(then)) > np.mean(np.log(np.maximum(exact, 1e-9))) + 0.5
    # Four standard errors of a share of 4,000, and 0.02 for what three directions leave out.
    assert np.mean(then > 0.5) == pytest.approx(np.mean(np.maximum(then, 1.0 - then)), abs=0.04)


def test_an_effect_that_is_wanted_in_another_form_loses_to_something_unnamed():
    first = said({"one": 100.0, "two": 97.0})
    for log_bayes in (-5.0, 0.0):
        assert in_another_form(first, "one", log_bayes) is first
    before, after = first.probability, in_another_form(first, "one", 6.0).probability
    # in another form: a tenth of it before the records, times 403
    weight = 0.1 * np.expm1(6.0) * before["one"]
    assert after["one"] == pytest.approx(before["one"] / (1.0 + weight))
    assert after[UNNAMED] == pytest.approx((before[UNNAMED] + weight) / (1.0 + weight))
    assert sum(after.values()) == pytest.approx(1.0)
    assert after["one"] < 0.05
