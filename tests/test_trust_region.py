"""Steps of a fit along a valley that bends."""

import numpy as np
import pytest

from rigid.localfit import trust_region
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Terms
from rigid.localfit.trust_region import Bend, model_of, moved_within, promised

SHARP = 300.0
"""Noise sds by which the records are off, a prior sd beside the valley."""
FACTOR = np.log(10.0)


def fit_at(w: np.ndarray) -> LocalFit:
    """Records that know w_1 - w_0^2/4 well, and w_0 a little: it is at 6."""
    expected = np.array([SHARP * (w[1] - 0.25 * w[0] ** 2), 3.0 * w[0]])
    residual = np.array([0.0, 18.0]) - expected
    design = np.array([[-0.5 * SHARP * w[0], SHARP], [3.0, 0.0]])
    local = object.__new__(LocalFit)
    terms = Terms(-0.5 * residual**2, residual, np.ones(2))
    vars(local).update(w=w, z_noise=np.zeros(0), residual=residual, terms=terms, design=design)
    return local


def turns(bending: bool) -> int:
    """Steps until the top is closer than a tenth of a nat."""
    here, bend, radius = fit_at(np.zeros(2)), None, 2.0
    for turn in range(300):
        if promised(here) < 0.1:
            return turn
        step, gain = moved_within(model_of(here, bend), radius)
        there, length = fit_at(here.w + step), float(np.abs(step).max())
        if there.value <= here.value:
            radius = 0.3 * length
            continue
        radius = min(2.0 * length, 2.0) if there.value - here.value > 0.8 * gain else length
        bend = Bend.between(here, there) if bending else None
        here = there
    return 300


def test_a_step_follows_the_bend_of_the_last_one(monkeypatch):
    monkeypatch.setattr(trust_region, "log_factors_of", lambda _: np.zeros(2))
    assert turns(bending=True) < 0.6 * turns(bending=False)


def test_a_bend_is_the_second_derivative_along_the_step(monkeypatch):
    """Of an amplitude by decades, to which the readings are in proportion, there is none."""
    monkeypatch.setattr(trust_region, "log_factors_of", lambda _: np.array([0.0, FACTOR]))

    def fit(w: np.ndarray) -> LocalFit:
        grown = np.exp(FACTOR * w[1])
        design = np.array([[2.0 * w[0], FACTOR * grown], [0.0, 3.0 * FACTOR * grown]])
        local = object.__new__(LocalFit)
        vars(local).update(w=w, design=design)
        return local

    first, last = np.array([0.5, 0.1]), np.array([0.9, 0.4])
    bend = Bend.between(fit(first), fit(last))
    # x^2 has 2 dx^2; the same amplitudes as the step has, seen from its end
    np.testing.assert_allclose(bend.by, [2.0 * 0.4**2, 0.0], atol=1e-12)
    np.testing.assert_allclose(bend.along, [0.4, -np.expm1(-0.3 * FACTOR) / FACTOR])
    assert Bend.between(fit(last), fit(last)).along == pytest.approx(0.0)


def test_slopes_whose_squares_are_no_numbers_are_nowhere_to_go_on_from():
    steep = fit_at(np.array([6.0, 9.0]))
    vars(steep).update(design=steep.design * 1e200)
    assert np.isfinite(steep.design).all()
    assert not steep.finite
    assert fit_at(np.array([6.0, 9.0])).finite
