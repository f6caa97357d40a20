"""Gain and zero integrated out, fine converters, and a channel at rest between two codes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from rigid.likelihood.noise import (
    FINE_STEP,
    Spread,
    Sums,
    gaussian,
    least_squares,
    marginal,
    moments,
    quadratic,
    rounding,
    sample_law,
)
from rigid.likelihood.quantisation import interval

STEP = 295.0


def sensor_samples(n: int, sigma: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """True values of a ramp and a hold, and what a sensor with its own gain and zero recorded."""
    rng = np.random.default_rng(seed)
    true = np.minimum(np.linspace(0, 3e5, n), 2e5)
    read = 1.0012 * true - 80.0 + sigma * rng.standard_normal(n)
    return true, np.round(read / STEP) * STEP


def expanded(law, true: np.ndarray, data: np.ndarray, variance: float, spread: Spread):
    weight, reading = jnp.ones((len(data), 1)), jnp.asarray(true)[:, None]
    column = jnp.asarray(data)[:, None]
    sums = Sums(*(x / variance for x in moments(column, weight, reading)))
    at = least_squares(sums, spread)
    return marginal(quadratic(law, at.gain, at.zero, column, weight, reading), at, spread)


@pytest.mark.parametrize("sigma_steps", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("n", [150, 1500])
def test_marginal_is_the_integral_over_gain_and_zero(n: int, sigma_steps: float):
    sigma, spread = sigma_steps * STEP, Spread(1e-3, 100.0)
    true, data = sensor_samples(n, sigma, 3)
    law = sample_law(jnp.asarray([sigma]), STEP, rounding(STEP, sigma))
    found = expanded(law, true, data, sigma**2 + STEP**2 / 12, spread)
    # 41 x 41 nodes over 6 sd of the Gaussian law: exact for smooth laws to far below the bar.
    gain_sd, zero_sd = float(found.var_gain[0]) ** 0.5, float(found.var_zero[0]) ** 0.5
    u = np.linspace(-6, 6, 41)
    gains = float(found.best.gain[0]) + gain_sd * u
    slope = float(found.covariance[0] / found.var_gain[0])
    rest = np.sqrt(zero_sd**2 - slope**2 * gain_sd**2)
    total = np.empty((len(u), len(u)))
    for i, gain in enumerate(gains):
        zeros = float(found.best.zero[0]) + slope * gain_sd * u[i] + rest * u
        r = data[:, None] - (1 + gain) * true[:, None] - zeros
        value = np.asarray(interval(jnp.asarray(r), jnp.asarray(sigma), STEP).value).sum(axis=0)
        prior = stats.norm.logpdf(gain, 0, spread.gain) + stats.norm.logpdf(zeros, 0, spread.zero)
        total[i] = value + prior
    area = gain_sd * rest * (u[1] - u[0]) ** 2
    top = total.max()
    exact = top + np.log(np.exp(total - top).sum() * area)
    # Skewness of the law over gain and zero, of order 1/n, and the curve's 1e-6 a sample.
    assert float(found.value[0]) == pytest.approx(exact, abs=0.02)


def test_least_squares_is_the_ridge_solution():
    spread = Spread(1e-3, 100.0)
    true, data = sensor_samples(200, 100.0, 4)
    sums = moments(*(jnp.asarray(x)[:, None] for x in (data, np.ones(200), true)))
    variance = 100.0**2
    found = least_squares(Sums(*(x / variance for x in sums)), spread)
    design = np.column_stack([true * spread.gain, np.full(200, spread.zero)]) / 100.0
    expected = np.linalg.solve(design.T @ design + np.eye(2), design.T @ (data - true) / 100.0) * [
        spread.gain,
        spread.zero,
    ]
    got = [float(found.gain[0]), float(found.zero[0])]
    np.testing.assert_allclose(got, expected, rtol=1e-9)


def test_fine_converters_are_gaussian():
    """At a quarter of the noise the two laws hold the same information to 2e-6 of a sample's."""
    sigma, step = 1.0, FINE_STEP
    offsets = np.linspace(-0.5, 0.5, 33)[:-1] * step
    codes = step * np.arange(-40, 41)
    r = jnp.asarray(codes[:, None] - offsets)
    exact = interval(r, jnp.asarray(sigma), step)
    close = gaussian(r, jnp.asarray(sigma), step)
    p = np.exp(np.asarray(exact.value))
    information = (p * np.asarray(exact.slope) ** 2).sum(axis=0).mean()
    assert information == pytest.approx(1.0 / (sigma**2 + step**2 / 12), rel=4e-6)
    # The mean difference of the log-likelihoods is their divergence: nothing at 6,000 samples.
    divergence = (p * np.asarray(exact.value - close.value)).sum(axis=0)
    assert np.abs(divergence).max() * 6000 < 0.01
    # And the Gaussian score is unbiased whatever the offset between codes.
    bias = (p * np.asarray(close.slope)).sum(axis=0)
    assert np.abs(bias).max() < 1e-6


def test_without_a_converter_it_is_a_density():
    point = gaussian(jnp.asarray([0.3]), jnp.asarray([0.7]), 0.0)
    assert float(point.value[0]) == pytest.approx(stats.norm.logpdf(0.3, 0, 0.7), rel=1e-14)


@pytest.mark.parametrize("step", [0.0, 0.2, 3.0])
def test_slope_and_curvature_are_derivatives(step: float):
    law = sample_law(jnp.asarray([1.0]), step, rounding(step, 1.0))
    for r in (-2.0, 0.1, 1.4):
        value = lambda m, r=r: law(r - m[None]).value[0]  # noqa: E731
        zero = jnp.asarray(0.0)
        point = law(jnp.asarray([r]))
        assert float(jax.grad(value)(zero)) == pytest.approx(float(point.slope[0]), abs=1e-9)
        bend = jax.jvp(jax.grad(value), (zero,), (jnp.ones(()),))[1]
        assert float(bend) == pytest.approx(float(point.curvature[0]), abs=1e-9)


def best_mean(data: np.ndarray, law) -> np.ndarray:
    """Most likely mean of each row by Newton steps."""
    mean = data.mean(axis=1)
    for _ in range(30):
        point = law(jnp.asarray(data - mean[:, None]))
        slope = np.asarray(point.slope).sum(axis=1)
        mean = mean - slope / np.asarray(point.curvature).sum(axis=1)
    return mean


def test_a_channel_at_rest_between_two_codes():
    """1,200 samples with noise of 0.3 steps: intervals are unbiased, codes taken as values not."""
    rng, seeds, n, sigma, true = np.random.default_rng(21), 300, 1200, 0.3, 0.27
    data = np.round(true + sigma * rng.standard_normal((seeds, n)))
    by_interval = best_mean(data, lambda r: interval(r, jnp.asarray(sigma), 1.0))
    as_values = data.mean(axis=1)  # what a Gaussian likelihood of any width makes of the codes
    se = by_interval.std()
    assert abs(by_interval.mean() - true) < 4 * se / np.sqrt(seeds)
    # First harmonic of the rounding error: sin(2 pi m) exp(-2 pi^2 sigma^2) / pi = 0.053 steps.
    expected = -np.sin(2 * np.pi * true) * np.exp(-2 * np.pi**2 * sigma**2) / np.pi
    bias = as_values.mean() - true
    assert bias == pytest.approx(expected, abs=0.003)
    assert abs(bias) > 3 * as_values.std()


def test_a_sensor_without_spread_is_taken_at_its_word():
    """Exact gain and zero: the likelihood is that of the residuals as they are."""
    sigma = 150.0
    true, data = sensor_samples(300, sigma, 5)
    law = sample_law(jnp.asarray([sigma]), 0.0, nodes=0)
    exact = expanded(law, true, data, sigma**2, Spread(0.0, 0.0))
    alone = stats.norm.logpdf(data - true, 0.0, sigma).sum()
    assert float(exact.value[0]) == pytest.approx(alone, rel=1e-12)
    assert [float(x[0]) for x in (*exact.best, *exact[2:])] == [0.0] * 5


@pytest.mark.parametrize("spread", [Spread(0.0, 100.0), Spread(1e-3, 0.0)])
def test_one_spread_of_none_is_the_limit_of_a_small_one(spread: Spread):
    """Spreads of 1e-9 of their usual size change the value by some 1e-9 of its derivative."""
    sigma = 150.0
    true, data = sensor_samples(300, sigma, 6)
    law = sample_law(jnp.asarray([sigma]), 0.0, nodes=0)
    small = Spread(spread.gain or 1e-12, spread.zero or 1e-7)
    at, near = (expanded(law, true, data, sigma**2, s) for s in (spread, small))
    assert float(at.value[0]) == pytest.approx(float(near.value[0]), rel=1e-9)
    for got, expected in ((at.best.gain, near.best.gain), (at.best.zero, near.best.zero)):
        assert float(got[0]) == pytest.approx(float(expected[0]), rel=1e-5, abs=1e-8)
    for got, expected in ((at.var_gain, near.var_gain), (at.var_zero, near.var_zero)):
        assert float(got[0]) == pytest.approx(float(expected[0]), rel=1e-5, abs=1e-12)
