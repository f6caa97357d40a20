"""The converter's probability against 60 digits, and the polynomial against it."""

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

from rigid.likelihood.quantisation import FEW, MANY, REACH, WIDE, curve, interval, nodes_of

mpmath.mp.dps = 60
RATIOS = (0.05, 0.3, 1.0, 2.0, 4.0, 10.0, 60.0)  # step over noise; default sheets: 2, 3 and 4


def reference(residual, sigma: float, step: float) -> mpmath.mpf:
    r, half = mpmath.mpf(abs(residual)) / sigma, mpmath.mpf(step) / (2 * mpmath.mpf(sigma))
    root = mpmath.sqrt(2)
    return mpmath.log((mpmath.erfc((r - half) / root) - mpmath.erfc((r + half) / root)) / 2)


@pytest.mark.parametrize("ratio", RATIOS)
def test_interval_has_the_exact_value_also_far_in_the_tails(ratio: float):
    sigma = 0.7
    step = ratio * sigma
    far = np.array([0.0, 0.1, 0.5, 1.0, 3.0, 6.0, 20.0, 35.0, 36.0, 60.0, 300.0, 1e4])
    residual = np.concatenate([-far, far]) * sigma
    got = np.asarray(interval(jnp.asarray(residual), jnp.asarray(sigma), step).value)
    expected = np.array([float(reference(r, sigma, step)) for r in residual])
    # A difference of two erfc: digits are lost where the interval is narrow; the asymptotic
    # series beyond FAR is cut after a relative 1e-8.
    np.testing.assert_allclose(got, expected, rtol=1e-11, atol=1e-7 if ratio > 1 else 1e-6)


@pytest.mark.parametrize("ratio", RATIOS)
def test_derivatives_are_those_of_the_value(ratio: float):
    sigma = 1.3
    step = ratio * sigma
    for r in np.array([-40.0, -3.3, -0.4, 0.2, 1.7, 5.0, 22.0, 200.0]) * sigma:
        h = mpmath.mpf(10) ** -12 * sigma

        def at(r, step=step):
            return reference(r, sigma, step)

        # Differences in 60 digits: no rounding, truncation (h/sigma)^2.
        r = mpmath.mpf(r)
        slope = -(at(r + h) - at(r - h)) / (2 * h)  # by the expected reading, which r subtracts
        bend = (at(r + h) - 2 * at(r) + at(r - h)) / h**2
        r = float(r)
        got = interval(jnp.asarray(r), jnp.asarray(sigma), step)
        assert float(got.slope) == pytest.approx(float(slope), rel=1e-6, abs=1e-7 / sigma)
        # Squares of order r^2 cancel to the curvature; the series is cut at 4e-9 of them.
        loose = 1e-8 * (1 + (r / sigma) ** 2) / min(ratio, 1.0) ** 2
        assert float(got.curvature) == pytest.approx(float(bend), rel=1e-6, abs=loose / sigma**2)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("mean", [0.0, 0.21, 0.5])
def test_probabilities_of_all_codes_sum_to_one(ratio: float, mean: float):
    step = 2.0
    sigma = step / ratio
    reach = int(np.ceil(9 / ratio)) + 2
    codes = step * np.arange(-reach, reach + 1)
    probability = np.exp(
        np.asarray(interval(jnp.asarray(codes - mean * step), jnp.asarray(sigma), step).value)
    )
    assert probability.sum() == pytest.approx(1.0, abs=1e-12)


def test_value_can_be_differentiated_in_the_noise_level():
    def at(log_sigma):
        return interval(jnp.asarray(0.8), jnp.exp(log_sigma), 2.0).value

    h = 1e-5
    difference = (at(h) - at(-h)) / (2 * h)
    assert float(jax.grad(at)(0.0)) == pytest.approx(float(difference), rel=1e-8)


@pytest.mark.parametrize("nodes", [FEW, MANY])
@pytest.mark.parametrize("ratio", [0.3, 1.0, 2.0, 3.0, 4.0, 6.0])
def test_curve_follows_the_interval_within_its_reach(ratio: float, nodes: int):
    sigma, step = jnp.asarray([1.0]), ratio
    r = np.linspace(-1, 1, 2001)[:, None] * (0.5 * ratio + REACH)
    got, exact = curve(sigma, step, nodes)(jnp.asarray(r)), interval(jnp.asarray(r), sigma, step)
    for name, bar in (("value", 1e-6), ("slope", 1e-5), ("curvature", 1e-3)):
        error = np.abs(np.asarray(getattr(got, name)) - np.asarray(getattr(exact, name)))
        assert error.max() < bar, (name, error.max())


@pytest.mark.parametrize(
    ("ratio", "nodes", "bar"), [(WIDE, FEW, 1e-9), (2 * WIDE, FEW, 1e-7), (12.0, MANY, 1e-9)]
)
def test_thousands_of_samples_are_as_probable_by_the_curve(ratio: float, nodes: int, bar: float):
    """The mean error under the law itself: noise at half of its sheet's still does with few."""
    r = jnp.linspace(-1, 1, 20001) * (0.5 * ratio + REACH)
    exact = interval(r, jnp.ones(1), ratio).value
    error = curve(jnp.ones(1), ratio, nodes)(r).value - exact
    share = jnp.exp(exact) / jnp.exp(exact).sum()
    assert abs(float(share @ error)) < bar


def test_few_values_do_for_narrow_steps_alone():
    assert (nodes_of(WIDE, 1.0), nodes_of(1.01 * WIDE, 1.0)) == (FEW, MANY)


@pytest.mark.parametrize("ratio", [2.0, 3.0, 4.0])
def test_curve_beyond_its_reach(ratio: float):
    """Beyond 5 sd the parabola is off by less than 1 % of the value up to 20 sd."""
    beyond = np.linspace(0.0, 15.0, 200)[:, None]
    r = jnp.asarray(0.5 * ratio + REACH + beyond)
    got, exact = curve(jnp.ones(1), ratio)(r), interval(r, jnp.ones(1), ratio)
    relative = np.abs(np.asarray(got.value) / np.asarray(exact.value) - 1.0)
    assert relative.max() < 0.01
    assert np.all(np.asarray(got.curvature) < 0)
    assert np.all(np.diff(np.asarray(got.value), axis=0) < 0)


@pytest.mark.parametrize("ratio", [4.0, 12.0, 24.0, 60.0])
def test_curve_is_concave_where_the_interval_is_flat(ratio: float):
    r = jnp.linspace(0.0, 0.5 * ratio + 2 * REACH, 4001)[:, None]
    got = np.asarray(curve(jnp.ones(1), ratio)(r).curvature)
    exact = np.asarray(interval(r, jnp.ones(1), ratio).curvature)
    assert np.all(got <= 0.0)
    inside = np.asarray(r) < 0.5 * ratio
    assert got[inside].mean() == pytest.approx(exact[inside].mean(), rel=0.02)


def test_curve_serves_several_noise_levels_at_once():
    sigma = jnp.asarray([[0.5, 1.0, 2.0], [0.7, 1.5, 3.0]])
    r = jnp.asarray(np.random.default_rng(1).normal(size=(40, 2, 1))) * sigma
    got = curve(sigma, 2.0)(r)
    np.testing.assert_allclose(got.value, interval(r, sigma, 2.0).value, atol=2e-6)


def test_curve_has_derivatives_of_one_piece():
    """Slope and curvature are those of the value that is used, also where the parabola begins."""
    made = curve(jnp.ones(1), 2.0)
    # Powers of t up to 16 have coefficients of some 1e4 times the value's: 1e4 roundings of 1e-16.
    for r in (0.0, 0.3, 2.0, 5.9, 6.1, 9.0):
        slope = jax.grad(lambda x: made(x[None]).value[0])(jnp.asarray(r))
        assert -float(slope) == pytest.approx(float(made(jnp.asarray([r])).slope[0]), rel=1e-9)
