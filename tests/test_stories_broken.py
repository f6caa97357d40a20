"""Evidence follows what is printed: a story that is broken on purpose falls behind.

Points are fewer than a run takes. The scale is that of a slip: a number that a story cannot give
costs it ln 1000, so a story that gives all four numbers costs less than one slip, and one that
fails at two of them at least two.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from test_stories import SPEC, printed_as

from rigid.published import evidence
from rigid.published.catalogue import STORIES
from rigid.published.inference import open_quantities, values_at, weigh, weighed_at
from rigid.published.printed import BLUNDER
from rigid.published.story import plain

pytestmark = pytest.mark.slow
SLIP = -np.log(BLUNDER)


@pytest.fixture(autouse=True)
def fewer(monkeypatch):
    for name, value in {"FIRST": 2**13, "ROUND": 2**12, "SIZE": 512, "MOST_ROUNDS": 6}.items():
        monkeypatch.setattr(evidence, name, value)


def story(key):
    return next(s for s in STORIES if s.key == key)


def release(one, spec=SPEC):
    """Evidence of frame and release, and the range of four errors about it."""
    found = weigh(one, "catalogue", spec, 1).release_evidence()
    assert found.error < 0.2
    return found.log, found.log - 4 * found.error, found.log + 4 * found.error


def test_evidence_is_the_plain_mean_over_the_prior():
    one = story("near")
    found = weigh(one, "catalogue", SPEC, 1).evidence()
    opened = open_quantities(one, SPEC)
    z = np.random.default_rng(5).standard_normal((2**15, len(opened)))
    log = weighed_at(one, "catalogue", values_at(opened, "catalogue", z, SPEC), SPEC)
    plainly = logsumexp(log.log_likelihood()) - np.log(len(z))
    scatter = 1.0 / np.sqrt(evidence.effective(log.log_likelihood()))
    assert scatter < 0.2
    assert plainly == pytest.approx(found.log, abs=4 * np.hypot(scatter, found.error))


def test_a_story_that_gives_all_numbers_costs_less_than_a_slip():
    assert release(story("near"))[1] > -SLIP


def test_a_story_with_friction_of_the_wrong_sign_costs_two_slips():
    """A swing that should decay grows, as with (20): it never ends, and no prior repairs that."""

    def growing(one, values):
        found = plain(one, values)
        swings = np.imag(found.rates) != 0.0
        return found._replace(rates=np.where(swings, -np.conj(found.rates), found.rates))

    # Where frame and period are certain the bound is met, to ln(1 + 1e-3) each.
    assert release(replace(story("near"), respond=growing))[0] < -2 * SLIP + 0.01


def test_a_story_that_moves_at_half_the_speed_costs_a_slip():
    """20 ms in place of 10: no spread of the rig's constants bridges that."""

    def slower(one, values):
        found = plain(one, values)
        return found._replace(rates=found.rates / 2.0)

    assert release(replace(story("near"), respond=slower))[2] < -SLIP


def test_the_story_leads_of_which_the_numbers_are():
    """Prints as a fixed root gives them at mu = 3.7e3: 13.6 ms, 235 ms to fall by e."""
    period, lasts = 13.64e-3, 235.1e-3 * np.log(20.0)
    changed = {
        "release_period": printed_as(SPEC.published.release_period, period),
        "release_duration": printed_as(SPEC.published.release_duration, lasts),
        "release_oscillations": printed_as(SPEC.published.release_oscillations, lasts / period),
    }
    spec = SPEC.model_copy(update={"published": SPEC.published.model_copy(update=changed)})
    assert release(story("small"), spec)[1] > -SLIP
    # Friction near critical ends within 20 ms or 60: duration and count are slips.
    assert release(story("near"), spec)[0] < -2 * SLIP + 0.01
    assert release(story("small"))[2] < -2 * SLIP
