"""P-values of discovery where nothing is missing; information has no negative direction."""

import numpy as np
import pytest
from scipy.stats import kstest

from rigid.discovery.unmodelled.sensors import SensorError
from rigid.discovery.weighing.explain import explain
from rigid.effects import CATALOGUE
from rigid.likelihood.priors import make_prior
from rigid.localfit.candidates import Candidate
from rigid.localfit.screening import Around, Screening, screen

SAMPLES, BUMPS, DEGREE = 600, 10, 8
CAMPAIGNS = 120
KNOWN = (1.0, 1e3, 1e5)
"""How far the fit's numbers move a sample within their priors, in noise sds. They do so much alike,
the more of them the farther: as mass and stiffness of an oscillator at one frequency do."""


def records(known: float) -> tuple[np.ndarray, np.ndarray, tuple[SensorError, ...]]:
    """Slopes of a fit that follows any smooth course of a record, bumps over time, and whose.

    - `known`: one of KNOWN. Most of the second lot the fit can absorb.
    """
    time = np.linspace(-1.0, 1.0, SAMPLES)
    design = known * np.vander(time + 3.0, DEGREE + 1)
    centres = np.linspace(-1.0, 1.0, BUMPS)
    width = centres[1] - centres[0]
    columns, targets = [], []
    for number, size in enumerate((1.0, 1e4)):
        height = np.maximum(0.0, 1.0 - np.abs(time[:, None] - centres) / width)
        smooth = np.polynomial.legendre.legvander(time, BUMPS - 1)  # absorbed but for two
        columns.append(size * (height if number == 0 else smooth))
        targets += [SensorError("force", "time", f"{number},A")] * BUMPS
    return design, np.concatenate(columns, axis=1), tuple(targets)


def screened(design: np.ndarray, columns: np.ndarray, score: np.ndarray) -> Screening:
    """The tests at the optimum of a fit to what is off the reading of the priors' centre."""
    both = np.concatenate([design, np.eye(design.shape[1])])
    w = np.linalg.lstsq(both, np.concatenate([score, np.zeros(design.shape[1])]), rcond=None)[0]
    left = score - design @ w
    return screen(Around(left, np.ones(SAMPLES), design, design.T @ left - w), columns)


@pytest.mark.parametrize("known", KNOWN)
def test_p_values_are_uniform_where_nothing_is_missing(known):
    """Of 120 p-values the largest step off uniform is below 0.178 in 999 of 1,000 (Kolmogorov)."""
    design, columns, targets = records(known)
    found = []
    for seed in range(CAMPAIGNS):
        rng = np.random.default_rng([61, seed])
        score = design @ rng.standard_normal(design.shape[1]) + rng.standard_normal(SAMPLES)
        found.append(explain((), targets, screened(design, columns, score), seed).p_value)
    assert kstest(found, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("known", KNOWN)
def test_no_direction_has_less_than_nothing(known):
    """What is left of a trace is a sum of squares: eigenvalues are 0 to rounding of the largest."""
    design, columns, _ = records(known)
    found = screened(design, columns, np.random.default_rng(62).standard_normal(SAMPLES))
    seen = np.diag(found.information) > 0.0
    alike = found.only(seen).cosines
    assert np.linalg.eigvalsh(alike).min() > -1e-12


def test_p_values_are_small_where_something_is_missing():
    """Five sds in one bump of the first record."""
    design, columns, targets = records(10.0)
    score = np.random.default_rng(63).standard_normal(SAMPLES)
    score = score + columns[:, 4] * 10.0 / np.sqrt(columns[:, 4] @ columns[:, 4])
    assert explain((), targets, screened(design, columns, score), 0).p_value < 0.01


def test_the_best_of_many_settings_counts_in_full_however_strong_it_is():
    """A line of 19 sds, the best of so many frequencies that 28 nats are taken off."""
    design, columns, targets = records(10.0)
    time = np.arange(SAMPLES)
    line = np.sin(1.3 * time) / np.sqrt(0.5 * SAMPLES)
    score = np.random.default_rng(64).standard_normal(SAMPLES) + 19.0 * line
    prior = make_prior("lognormal", {"median": 1.0, "factor": 10.0}, "a")
    chance = tuple(np.linspace(-1.0, 0.5, 20))
    one = Candidate(CATALOGUE["pump-ripple"], "a", 0.0, prior, {}, log_share=-28.0, chance=chance)
    found = screened(design, np.concatenate([line[:, None], columns], axis=1), score)
    assert explain((one,), targets, found, 0).p_value < 0.01


def test_other_records_are_weighed_as_if_for_the_first_time():
    """What is simulated where nothing is missing does not depend on what records say."""
    design, columns, targets = records(10.0)
    prior = make_prior("lognormal", {"median": 1.0, "factor": 10.0}, "a")
    listed = (Candidate(CATALOGUE["load-cell-drift"], "a", 0.0, prior, {}),)
    some, other = (
        screened(design, columns, np.random.default_rng([65, k]).standard_normal(SAMPLES))
        for k in range(2)
    )
    mine = [0, *range(BUMPS * 2)]  # one column stands for the candidate as well
    some, other = some.only(np.array(mine)), other.only(np.array(mine))
    fresh = explain(listed, targets, other, 3)
    again = explain(listed, targets, some, 3).seen(other.slope)
    assert again.p_value == fresh.p_value != explain(listed, targets, some, 3).p_value
    np.testing.assert_array_equal(again.candidate, fresh.candidate)
    np.testing.assert_array_equal(again.bundle, fresh.bundle)
    np.testing.assert_array_equal(again.screening.slope, other.slope)
