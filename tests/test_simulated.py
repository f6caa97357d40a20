"""Noise of simulated campaigns: through the converter, and as uncertain as records leave it."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from rigid.likelihood.quantisation import interval
from rigid.localfit.noise.codes import FAR, Codes
from rigid.localfit.noise.leftover import Explaining, Told, coloured, left_by
from rigid.localfit.noise.simulated import DRAWS, drawn

RHO, STEP = 0.9, 3.0
TIME = (1.0 + RHO) / (1.0 - RHO)


def lasting(rng: np.random.Generator, samples: int, series: int = 1) -> np.ndarray:
    """AR(1) noise of unit variance (samples, series)."""
    white = rng.standard_normal((samples + 200, series))
    return np.asarray(lfilter([np.sqrt(1.0 - RHO**2)], [1.0, -RHO], white, axis=0))[200:]


def read(exact: np.ndarray, noise: np.ndarray, step: float) -> tuple[Codes, Explaining]:
    """Codes and scores of one channel whose readings are rounded; nothing explains anything."""
    n = len(exact)
    residual = step * np.round((exact + noise) / step) - exact
    reach = int(np.ceil(FAR / step))
    each = [
        interval(jnp.asarray(residual + k * step), jnp.asarray(1.0), step)
        for k in range(-reach, reach + 1)
    ]
    score = np.stack([np.asarray(one.slope) for one in each], axis=1)
    curvature = -np.asarray(each[reach].curvature)
    one = np.ones(1)
    codes = Codes((np.arange(n),), np.ones(n), step * one, residual, curvature, score, one)
    nothing = np.zeros((n, 0))
    around = Explaining(
        score[:, reach], curvature, (nothing,), np.zeros((0, 0)), *(np.zeros(0),) * 3
    )
    return codes, around


def swept(rng: np.random.Generator, samples: int) -> np.ndarray:
    """Readings that stand still for a half and then move over some steps of the converter."""
    return rng.uniform(0.0, STEP) + np.maximum(0.0, np.linspace(-30.0, 30.0, samples))


def test_a_score_is_that_of_the_code_which_the_noise_leads_to():
    rng = np.random.default_rng(1)
    exact, noise = swept(rng, 200), rng.standard_normal(200)
    codes, around = read(exact, noise, STEP)
    np.testing.assert_allclose(codes.of_noise(0, noise[:, None])[:, 0], around.score)
    other = rng.standard_normal(200)
    np.testing.assert_allclose(
        codes.of_noise(0, other[:, None])[:, 0], read(exact, other, STEP)[1].score, atol=1e-9
    )


def test_a_score_far_off_is_that_of_the_farthest_code():
    codes, _ = read(np.zeros(5), np.zeros(5), STEP)
    far = codes.of_noise(0, np.full((5, 1), 100.0))
    np.testing.assert_allclose(far, codes.score[:, -1:])


def test_noise_before_the_converter_lasts_longer_than_what_is_read_of_it():
    rng, samples = np.random.default_rng(2), 1500
    times = {"noise": [], "scores": []}
    for _ in range(12):
        codes, around = read(swept(rng, samples), lasting(rng, samples)[:, 0], STEP)
        every = [np.ones(samples, dtype=bool)]
        times["noise"].append(left_by(around, every, every[0], codes)[0].law.time)
        times["scores"].append(left_by(around, every, every[0])[0].law.time)
    # d log tau / d rho = 2/(1 - rho^2), sd of rho sqrt((1 - rho^2)/n): 12 % where all is read; a
    # converter of 3 sds reads half of it or less: 17 % of a channel and more, 5 to 10 % of twelve.
    assert np.mean(times["noise"]) == pytest.approx(TIME, rel=0.3)
    assert np.mean(times["scores"]) < 0.7 * TIME


def test_noise_that_swings_and_that_no_converter_rounds_swings_in_all_campaigns():
    rng, samples = np.random.default_rng(9), 1500
    pull = np.array([1.6, -0.9])  # swings once in eleven samples, and lasts for nineteen
    noise = lfilter([1.0], [1.0, *-pull], rng.standard_normal(samples + 500))[500:]
    every, one = [np.ones(samples, dtype=bool)], np.ones(1)
    nothing = np.zeros((samples, 0))
    even = np.ones(samples)
    codes = Codes((np.arange(samples),), even, 0.0 * one, noise, even, nothing, one)
    around = Explaining(noise, np.ones(samples), (nothing,), np.zeros((0, 0)), *(np.zeros(0),) * 3)
    own = left_by(around, every, every[0], codes)[0]
    (only,) = drawn(Told(own, None, ()), False, rng)
    assert len(only.columns) == DRAWS
    # sd of a coefficient sqrt((1 - 0.9^2)/n): 0.011; orders are chosen
    np.testing.assert_allclose(only.law.coefficients[:2], pull, atol=0.1)


def near(scores: np.ndarray) -> np.ndarray:
    """Correlation of scores (n, draws) from one sample to the next."""
    return np.mean(scores[1:] * scores[:-1], axis=0) / np.mean(scores**2, axis=0)


def test_simulated_scores_resemble_their_neighbours_as_those_on_record_do():
    rng, samples = np.random.default_rng(8), 1500
    found, simulated = [], []
    for _ in range(12):
        codes, around = read(swept(rng, samples), lasting(rng, samples)[:, 0], STEP)
        every = [np.ones(samples, dtype=bool)]
        law = left_by(around, every, every[0], codes)[0].law
        noise = coloured(law, rng.standard_normal((law.settling + samples, 50)))
        found.append(float(near(around.score[:, None])[0]))
        simulated.append(float(near(codes.of_noise(0, noise)).mean()))
    # a record's scatters by 0.05 and the law moves with it: of twelve, 0.015
    assert np.mean(simulated) == pytest.approx(np.mean(found), abs=0.05)


def test_noise_of_which_the_records_say_little_is_drawn_with_laws_as_unlike_as_that():
    """How large a mean of noise is by chance: with one law for all campaigns, too often too large.

    Of 150 samples whose memory is some ten, there are some eight independent ones.
    """
    samples, campaigns, level = 150, 400, 0.02
    every = [np.ones(samples, dtype=bool)]
    one, even = np.ones(1), np.ones(samples)
    below = {"drawn": 0, "likeliest": 0}
    for seed in range(campaigns):
        noise = lasting(np.random.default_rng([30, seed]), samples)
        codes = Codes((np.arange(samples),), even, 0.0 * one, noise[:, 0], even, noise, one)
        nothing = np.zeros((samples, 0))
        around = Explaining(
            noise[:, 0], np.ones(samples), (nothing,), np.zeros((0, 0)), *(np.zeros(0),) * 3
        )
        own = left_by(around, every, every[0], codes)[0]
        rng, draw = np.random.default_rng([4, seed]), np.random.default_rng([5, seed])
        simulated = np.zeros((samples, DRAWS))
        for law, columns in drawn(Told(own, None, ()), False, rng):
            fresh = draw.standard_normal((law.settling + samples, len(columns)))
            simulated[:, columns] = coloured(law, fresh)
        alone = coloured(own.law, draw.standard_normal((own.law.settling + samples, DRAWS)))
        here = np.abs(noise.mean())
        for name, campaign in (("drawn", simulated), ("likeliest", alone)):
            below[name] += np.mean(np.abs(campaign.mean(axis=0)) >= here) < level
    most = binom.isf(0.001, campaigns, level)
    assert below["drawn"] <= most
    assert below["likeliest"] > most


def test_records_of_a_sensor_share_the_law_of_each_campaign():
    rng, samples = np.random.default_rng(6), 400
    noise = lasting(rng, samples, 2).T.ravel()
    rows = [np.repeat([True, False], samples), np.repeat([False, True], samples)]
    nothing = np.zeros((2 * samples, 0))
    around = Explaining(
        noise, np.ones(2 * samples), (nothing,), np.zeros((0, 0)), *(np.zeros(0),) * 3
    )
    first, second = left_by(around, rows, np.ones(2 * samples, dtype=bool))

    def laws(mine, other) -> np.ndarray:
        """Sum of the autocorrelations in each campaign."""
        times = np.zeros(DRAWS)
        for law, columns in drawn(Told(mine, mine, (other,)), False, np.random.default_rng(7)):
            assert (times[columns] == 0.0).all()
            times[columns] = law.time
        assert (times > 0.0).all()
        return times

    one, two = laws(first, second), laws(second, first)
    # 0.9 beforehand, and more since they are alike
    same = np.isclose(one, two)
    assert same.mean() > 0.85
    assert len(np.unique(one[same])) > 10
