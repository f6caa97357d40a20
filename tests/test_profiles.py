"""Profiles that lead from one optimum to another, and searches that follow them."""

import numpy as np
import pytest
from rigs import release_problem

import rigid
from rigid.inference import search as searching
from rigid.inference.newton import Expansion, joined
from rigid.inference.profiles import (
    FARTHEST,
    TOO_HIGH,
    Place,
    other_optima,
    over_a_barrier,
    profile,
)
from rigid.inference.search import search
from rigid.validation.campaign import Base, draw
from rigid.validation.design import Design

BARRIER = 6.0


def two_wells(w: np.ndarray) -> Expansion:
    """Two optima, at x = -1 and (0.6 nats better) at x = 1, on a bent sheet y = x^2."""
    x, y = w
    value = BARRIER * (x * x - 1.0) ** 2 - 0.3 * x + 200.0 * (y - x * x) ** 2
    by_x = 4.0 * BARRIER * x * (x * x - 1.0) - 0.3 - 800.0 * x * (y - x * x)
    by_y = 400.0 * (y - x * x)
    twice = 4.0 * BARRIER * (3.0 * x * x - 1.0) - 800.0 * (y - 3.0 * x * x)
    information = np.array([[twice, -800.0 * x], [-800.0 * x, 400.0]])
    return Expansion(value, np.array([by_x, by_y]), information)


def place(x: float) -> Place:
    w = np.array([x, x * x])
    return Place(w, two_wells(w))


def test_a_profile_leads_over_the_barrier_to_the_other_optimum():
    places = profile(two_wells, place(-1.0), 0, 1.0)
    np.testing.assert_allclose([p.w[1] for p in places], [p.w[0] ** 2 for p in places], atol=0.1)
    assert max(p.value for p in places) > BARRIER
    behind = over_a_barrier(places)
    assert behind is not None
    assert behind.w[0] == pytest.approx(1.0)


def test_a_profile_that_only_rises_leads_nowhere():
    places = profile(two_wells, place(-1.0), 0, -1.0)
    assert places[-1].value > place(-1.0).value + TOO_HIGH
    assert over_a_barrier(places) is None


def test_a_profile_ends_at_the_end_of_the_prior_and_where_nothing_can_be_solved():
    def flat(w: np.ndarray) -> Expansion:
        return Expansion(0.5 * w[1] ** 2, np.array([0.0, w[1]]), np.diag([0.0, 1.0]))

    def walled(w: np.ndarray) -> Expansion:
        return flat(w) if w[0] < 0.6 else Expansion(np.nan, np.zeros(2), np.eye(2))

    begin = Place(np.zeros(2), flat(np.zeros(2)))
    assert profile(flat, begin, 0, 1.0)[-1].w[0] == pytest.approx(FARTHEST)
    ends = profile(walled, begin, 0, 1.0)[-1].w[0]
    assert 0.375 <= ends < 0.6  # half a prior sd, then strides of an eighth


def test_nothing_is_evaluated_where_there_is_no_sum(monkeypatch):
    problem = release_problem({"k_LC": 6e7, "mu": 2e4}, samples=192, noise=0.1)
    w = joined(problem, np.zeros(problem.parameters.size), np.zeros((len(problem.sensors), 2)))
    nothing = Expansion(0.0, np.zeros(len(w)), np.eye(len(w)))
    assert other_optima(problem, w, nothing, np.zeros(1)) == []


@pytest.mark.slow
def test_a_campaign_whose_starts_all_end_in_the_lesser_optimum(monkeypatch):
    """Campaign 15 of seed 60601 (docs/studies/validation-notes.md): by profiles 4.9 nats higher."""
    study = rigid.load("fits/calibration.toml")
    made = draw(Base(study.solved, study.records, study.problem), Design(60601), 15)
    found = search(made.problem, 4, 1)
    assert found.optima[0].reached == 4  # along a profile; the lesser one has them as well
    monkeypatch.setattr(searching, "other_optima", lambda *_: [])
    lesser = search(made.problem, 4, 1)
    assert found.optima[0].log_posterior > lesser.optima[0].log_posterior + 3.0
