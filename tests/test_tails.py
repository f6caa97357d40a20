"""Noise with heavy tails: found through the converter, told apart from what is missing, weighed."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import binom, norm

from rigid.likelihood.noise import sample_law
from rigid.localfit.noise.tails import TRIED, Counted, _clustered, tails, weights

SAMPLES, RECORDS, DOF = 1000, 5, 4.0
STEPS = (0.2, 1.0, 3.0)
"""Steps of converters, in noise; those of the reference sheets are 0.2 to 4."""
STRETCH = 10
"""Samples of a stretch whose scores are summed: as short as hidden forces over time are."""


def gauss(rng: np.random.Generator) -> np.ndarray:
    return rng.standard_normal(SAMPLES)


def student(rng: np.random.Generator) -> np.ndarray:
    """Student's noise of unit variance."""
    return rng.standard_t(DOF, SAMPLES) * np.sqrt((DOF - 2.0) / DOF)


def left(noise: np.ndarray, step: float, rng: np.random.Generator) -> np.ndarray:
    """What a fit that is right leaves of readings that move over some steps and are rounded."""
    exact = np.linspace(0.0, rng.uniform(0.0, 30.0), SAMPLES) + rng.uniform(0.0, step)
    return step * np.round((exact + noise) / step) - exact


def series(law, step: float, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [left(law(rng), step, rng) for _ in range(RECORDS)]


def told(residuals: list[np.ndarray], step: float) -> float | None:
    """Degrees of freedom that the records tell whose large samples do not come together."""
    apart = [r for r in residuals if not _clustered(r, step)]
    return tails({str(i): [Counted.of(r, step)] for i, r in enumerate(apart)}) if apart else None


@pytest.mark.parametrize("step", STEPS)
def test_tails_are_found_through_a_converter(step):
    found = [told(series(student, step, seed), step) for seed in range(10)]
    assert all(dof is not None and 3.0 <= dof <= 6.0 for dof in found)


@pytest.mark.parametrize("step", STEPS)
def test_a_gaussian_has_none(step):
    # The gain has to exceed half the log of 5,000 samples, 4.3: by chance at one number more, with
    # a probability below 0.002 a campaign (chi-square law of twice the gain).
    assert [told(series(gauss, step, seed), step) for seed in range(10)] == [None] * 10


@pytest.mark.parametrize("step", STEPS)
def test_what_one_record_alone_shows_is_none(step):
    rng = np.random.default_rng(7)
    residuals = series(gauss, step, 7)
    residuals[0] = left(student(rng), step, rng)
    channels = {str(i): [Counted.of(r, step)] for i, r in enumerate(residuals)}
    assert tails({"0": channels["0"]}) is not None
    assert tails(channels) is None


@pytest.mark.parametrize("step", STEPS)
def test_what_is_off_for_samples_in_a_row_is_something_missing(step):
    def missing(rng: np.random.Generator) -> np.ndarray:
        noise = gauss(rng)
        noise[300:320] += 4.0 + step
        return noise

    assert all(_clustered(r, step) for r in series(missing, step, 3))
    assert sum(_clustered(r, step) for r in series(student, step, 3)) == 0


def sums_of_scores(residual: np.ndarray, weight: np.ndarray, step: float) -> np.ndarray:
    """Scores of stretches over what the likelihood says that they scatter by, noise at its best."""
    levels = jnp.geomspace(0.4, 1.6, 41)[:, None]
    heights = np.asarray(sample_law(levels, step, 17)(jnp.asarray(residual)).value) @ weight
    best = sample_law(levels[int(np.argmax(heights))], step, 17)(jnp.asarray(residual))
    summed = (weight * np.asarray(best.slope)).reshape(-1, STRETCH).sum(axis=1)
    return summed / np.sqrt(STRETCH * np.mean(-weight * np.asarray(best.curvature)))


def test_with_weights_short_stretches_look_like_nothing_missing():
    """Taken for Gaussian, stretches of heavy-tailed noise stand out more often than by chance."""
    step, far, weighed, even = 1.0, 3.0, [], []
    for seed in range(20):
        residuals = series(student, step, 100 + seed)
        lighter = weights([Counted.of(r, step) for r in residuals], DOF)
        for r, weight in zip(residuals, lighter, strict=True):
            weighed.append(sums_of_scores(r, weight, step))
            even.append(sums_of_scores(r, np.ones(SAMPLES), step))
    beyond = [np.count_nonzero(np.abs(np.concatenate(z)) > far) for z in (weighed, even)]
    most = binom.isf(1e-3, RECORDS * 20 * SAMPLES // STRETCH, 2.0 * norm.sf(far))
    assert beyond[0] <= most < beyond[1]


def test_weights_hold_the_information_of_students_law():
    """A density: (nu + 1) / (nu + 3) of a sample, by a residual's size (nu + 1) / (nu + r^2)."""
    rng, scale = np.random.default_rng(11), np.sqrt((DOF - 2.0) / DOF)
    noise = student(rng)
    (weight,) = weights([Counted.of(noise, 0.1)], DOF)
    expected = (DOF + 1.0) ** 2 / (DOF + 3.0) / (DOF + (noise / scale) ** 2)
    # its scale is told by 1,000 samples to some 3 %, the mean square score to 2 %
    near = np.abs(noise) < 3.0
    np.testing.assert_allclose(weight[near], expected[near], rtol=0.15, atol=0.02)
    assert DOF in TRIED
