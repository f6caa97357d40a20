"""A fit that is held near its priors: what is held, and what the rest does."""

import numpy as np
import pytest
from test_screening import campaign, fitted

from rigid.discovery.near import held_near, let_go
from rigid.discovery.refit import Refit, guess_of
from rigid.effects import CATALOGUE
from rigid.localfit.candidates import candidates
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.hypothesis import Hypothesis, widened
from rigid.localfit.settled import nearer_priors, state_of

FAR = "kappa[free-run-1,A]"


@pytest.mark.slow
def test_a_number_that_has_left_its_prior_is_held_and_the_rest_follows():
    """Three times the flow that the prior knows to a fifth, as in tests/test_settled.py."""
    local, _ = fitted(campaign(401, **{FAR: 0.6}))
    assert [label for label, _ in state_of(local).far] == [FAR]
    near = held_near(local)
    assert near is not None
    prior = local.hypothesis.parameters[local.hypothesis.labels.index(FAR)].prior
    assert near.hypothesis.held == {FAR: pytest.approx(float(prior.from_standard(0.0)))}
    assert len(near.w) == len(local.w) - 1
    # between where the number alone goes back, and the fit that is free
    alone = expanded(local.family, Point.beside(local, nearer_priors(local)[0]))
    assert alone.value < near.value < local.value
    w = let_go(near, local)
    assert w[local.hypothesis.labels.index(FAR)] == 0.0
    np.testing.assert_array_equal(np.delete(w, local.hypothesis.labels.index(FAR)), near.w)
    there = expanded(local.family, Point.beside(local, w))
    np.testing.assert_allclose(there.reading, near.reading, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
def test_nothing_is_held_in_a_fit_that_keeps_to_its_priors():
    assert held_near(fitted(campaign(400))[0]) is None


@pytest.mark.slow
def test_a_fit_with_a_twin_begins_where_the_other_has_ended():
    local, programs = fitted(campaign(301))
    (candidate,) = candidates([CATALOGUE["load-cell-drift"]], 1)
    extended = Hypothesis(local.layout.problem).plus(candidate.effect)
    moved = widened(local.hypothesis, local.w + 0.01, [0.4])
    after = expanded(programs[0], Point(extended, local.layout, moved, local.z_noise))
    guess = guess_of(Refit(candidate, local, after, 0.0), local)
    np.testing.assert_array_equal(guess.w, local.w + 0.01)
    assert guess.own[candidate.amplitude] == extended.values(moved)[candidate.amplitude][0]
