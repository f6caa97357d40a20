"""How many facts a series holds, and that intervals cover because of it."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from rigid.likelihood import noise_spectrum
from rigid.likelihood.common_noise import common_law
from rigid.likelihood.correlation import ahead, autocovariance, noise_law
from rigid.likelihood.noise_spectrum import NoiseLaw, of_parts
from rigid.likelihood.periodogram import Found, periodogram
from rigid.likelihood.quantisation import interval

ALL = np.ones(1200, dtype=bool)


def ar1(rng: np.random.Generator, rho: float, shape: tuple[int, int]) -> np.ndarray:
    """Rows of AR(1) series of unit variance, in equilibrium."""
    white = rng.standard_normal((shape[0], shape[1] + 200)) * np.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], white, axis=1)[:, 200:]


def test_white_series_are_white():
    series = np.random.default_rng(31).standard_normal((300, 1200))
    found = [noise_law(s, ALL) for s in series]
    plain = [f for f in found if f.time == 1.0 and len(f.coefficients) == 0]
    # BIC takes one order too many with the chance of chi^2_1 > log 1200: 0.8 %, and each of 8
    # orders has its own, smaller one.
    assert len(plain) > 0.95 * len(found)
    assert max(f.time for f in found) < 1.5


def test_a_law_of_few_samples_has_the_mean_time_of_all_that_they_allow():
    """Two series of 300 hardly tell a part that lasts fifty samples; the simplest law has none."""
    rng, price = np.random.default_rng(35), float(np.log(600))
    fast, slow = ar1(rng, 0.45, (120, 300)), ar1(rng, 0.98, (120, 300))
    series = np.sqrt(0.7) * fast + np.sqrt(0.3) * slow
    found = [Found.of(periodogram(s[:, None], ALL[:300])) for s in series]
    laws = [common_law(found[i : i + 2], price, 1.0).law for i in range(0, 120, 2)]
    time = 0.7 * 1.45 / 0.55 + 0.3 * 1.98 / 0.02
    # parts slower than a sixth of a series are not tried: the mean stays short of the truth
    assert time / 3.0 < np.median([law.time for law in laws]) < time
    simplest = [
        law.variance * (1.0 + law.averages.sum()) ** 2 / (1.0 - law.coefficients.sum()) ** 2
        for law in laws
    ]
    assert np.median(simplest) < time / 4.0


def test_correlated_series_have_their_time():
    rng, rho = np.random.default_rng(32), 0.8
    found = [noise_law(s, ALL).time for s in ar1(rng, rho, (300, 1200))]
    expected = (1 + rho) / (1 - rho)
    # d log tau / d rho = 2/(1 - rho^2), sd of rho sqrt((1 - rho^2)/n); bias of order 1/n.
    scatter = 2 / (1 - rho**2) * np.sqrt((1 - rho**2) / 1200) * expected
    assert np.mean(found) == pytest.approx(expected, abs=0.4)
    assert np.std(found) < 1.5 * scatter


@pytest.mark.parametrize(
    ("shares", "decays", "short"),
    [((0.43, 0.57), (0.0, 0.95), 0.8), ((0.7, 0.3), (0.45, 0.98), 0.4)],
)
def test_slow_parts_are_seen_beside_quick_ones(shares, decays, short, monkeypatch):
    """A converter's rounding beside a sensor that drifts; eight lags alone do not see it."""
    rng, n, series = np.random.default_rng(36), 1500, 60
    parts = [np.sqrt(s) * ar1(rng, d, (series, n)) for s, d in zip(shares, decays, strict=True)]
    noise, read = sum(parts), np.ones(n, dtype=bool)
    expected = sum(s * (1 + d) / (1 - d) for s, d in zip(shares, decays, strict=True))

    def off() -> np.ndarray:
        return np.log([noise_law(one, read).time / expected for one in noise])

    found = off()
    # docs/inference.md: logs scatter by 0.3 and 0.64, so that a mean of 60 does by 0.04 and 0.08
    assert abs(found.mean()) < 0.25
    monkeypatch.setattr(noise_spectrum.Whittle, "fading", lambda _: ())
    assert off().mean() < np.log(short)


def test_a_law_makes_noise_of_its_own_spectrum():
    """Parts become an autoregression with a moving average: the same sums of autocovariances."""
    law = of_parts(0.2, np.array([0.5, 0.3]), np.array([0.6, 0.95]))
    turn = np.linspace(0.1, 3.0, 9)
    step = np.exp(-1j * turn)
    top, bottom = (
        np.polyval(np.append(one[::-1], 1.0), step) for one in (law.averages, -law.coefficients)
    )
    parts = [s * (1 - d**2) / np.abs(1 - d * step) ** 2 for s, d in ((0.5, 0.6), (0.3, 0.95))]
    np.testing.assert_allclose(law.variance * np.abs(top / bottom) ** 2, 0.2 + sum(parts))
    assert law.time == pytest.approx(0.2 + 0.5 * 4.0 + 0.3 * 39.0)


def test_one_step_ahead_residuals_are_white():
    rng = np.random.default_rng(33)
    series = ar1(rng, 0.8, (1, 4000))[0]
    fit = noise_law(series, np.ones(4000, dtype=bool))
    next_ = ahead(fit, series, np.ones(4000, dtype=bool))
    covariance = autocovariance(next_, np.ones(4000, dtype=bool), 5)
    assert np.abs(covariance[1:] / covariance[0]).max() < 4 / np.sqrt(4000)


def test_gaps_are_left_out():
    rng = np.random.default_rng(34)
    series = ar1(rng, 0.5, (1, 3000))[0]
    valid = rng.random(3000) > 0.02
    holed = np.where(valid, series, 1e6)
    fit = noise_law(holed, valid)
    # One pair in 50 is missing from every lag: the time falls short by as many percent.
    assert fit.time == pytest.approx(3.0, rel=0.25)
    assert np.all(np.isnan(ahead(fit, holed, valid)[~valid]))


def test_short_and_constant_series_are_left_alone():
    assert noise_law(np.ones(10), np.ones(10, dtype=bool)).time == 1.0
    assert noise_law(np.zeros(100), np.ones(100, dtype=bool)).time == 1.0


def test_a_trend_still_counts_as_something():
    trend = np.linspace(-1, 1, 2000)
    found = noise_law(trend, np.ones(2000, dtype=bool))
    assert 50 < found.time <= 500
    assert isinstance(found, NoiseLaw)


def test_intervals_of_a_mean_cover_with_tempering_and_not_without():
    """AR(1) noise of half a step through the converter: 90 % intervals of the mean."""
    rng, seeds, sigma, rho = np.random.default_rng(35), 400, 0.5, 0.8
    true = rng.uniform(-0.5, 0.5, seeds)
    data = np.round(true[:, None] + sigma * ar1(rng, rho, (seeds, 1200)))
    mean = data.mean(axis=1)
    for _ in range(20):
        point = interval(jnp.asarray(data - mean[:, None]), jnp.asarray(sigma), 1.0)
        slope, bend = np.asarray(point.slope), -np.asarray(point.curvature).sum(axis=1)
        mean = mean + slope.sum(axis=1) / bend
    time = np.array([noise_law(s, ALL).time for s in slope])
    pull = (mean - true) * np.sqrt(bend)
    covered = np.abs(pull / np.sqrt(time)) < stats.norm.ppf(0.95)
    untempered = np.abs(pull) < stats.norm.ppf(0.95)
    low, high = stats.binom.ppf([0.0005, 0.9995], seeds, 0.9)
    assert low <= covered.sum() <= high
    assert untempered.sum() < stats.binom.ppf(1e-6, seeds, 0.9)
