"""Jitter and something missing compete: the evidence for either, with all behind it, decides."""

import numpy as np
import pytest
from test_screening import CHOICE, campaign, fitted

from rigid.discovery import turn as module
from rigid.discovery.fitted import Fitted
from rigid.discovery.signatures import laid_out
from rigid.discovery.turn import Running, Turn, jittering
from rigid.io.cache import NOTHING_KEPT
from rigid.localfit.noise.instants import Jitter


def turn_of(problem) -> Turn:
    local, programs = fitted(problem)
    fit = Fitted(local, programs)
    return Turn(fit, laid_out(fit, CHOICE, NOTHING_KEPT), Running(0))


def asking(monkeypatch, log_bayes: float, variance: float = 1e3) -> None:
    """Scores ask for noise of so great a variance everywhere, with that evidence."""

    def asked_for(local):
        return Jitter(np.full(len(local.residual), variance), log_bayes)

    monkeypatch.setattr(module, "asked_for", asked_for)


@pytest.mark.slow
def test_jitter_is_reckoned_with_where_it_explains_more_than_what_may_be_missing(monkeypatch):
    missing = turn_of(campaign(302, R_hose=4e9))
    behind = max(missing.found.effects.values())
    assert behind > 50.0
    asking(monkeypatch, 0.5 * behind)  # by which the hose explains more
    assert jittering(missing) is missing
    asking(monkeypatch, 2.0 * behind, variance=2.0)  # and the hose explains much still
    assert jittering(missing) is missing
    asking(monkeypatch, 2.0 * behind)
    louder = jittering(missing)
    assert np.allclose(louder.fit.local.layout.weight, 1e-3 * missing.fit.local.layout.weight)
    assert max(louder.found.effects.values()) < 0.1 * behind
    monkeypatch.setattr(module, "asked_for", lambda _: None)
    assert jittering(missing) is missing
