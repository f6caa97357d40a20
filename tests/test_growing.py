"""Noise that grows with the reading: found, told apart from tails and from what is missing."""

import jax.numpy as jnp
import numpy as np
import pytest

from rigid.likelihood.noise import sample_law
from rigid.localfit.noise.growing import TRIED, Left, growth_of
from rigid.localfit.noise.tails import GAUSS

SAMPLES, RECORDS = 1000, 5
STEPS = (0.2, 1.0, 3.0)
"""Steps of converters, in noise; those of the reference sheets are 0.2 to 4."""
REST = 200
"""Samples of a record before its reading moves: there a wide converter always reads the same."""
STRETCH = 10
"""Samples of a stretch whose scores are summed: as short as hidden forces over time are."""


def even(rng: np.random.Generator, share: np.ndarray) -> np.ndarray:
    return rng.standard_normal(len(share))


def growing(rng: np.random.Generator, share: np.ndarray) -> np.ndarray:
    """Its sd grows from one to two in a straight line, which is not the law that is fitted."""
    return (1.0 + share) * rng.standard_normal(len(share))


def tailed(rng: np.random.Generator, share: np.ndarray) -> np.ndarray:
    """Student's of four degrees of freedom, as loud everywhere."""
    return rng.standard_t(4.0, len(share)) / np.sqrt(2.0)


def left(share: np.ndarray, residual: np.ndarray, step: float) -> Left:
    score = np.sign(residual) * GAUSS.score(np.abs(residual), 0.5 * step, 1.0)
    return Left(residual, score, share, step)


def records(law, step: float, seed: int) -> list[Left]:
    """Presses, whose load grows to the greatest of all or to half of it, through a converter."""
    rng, out = np.random.default_rng(seed), []
    for number in range(RECORDS):
        moving = np.linspace(0.0, (1.0, 0.5)[number % 2], SAMPLES - REST)
        share = np.concatenate([np.zeros(REST), moving])
        exact = 400.0 * share + rng.uniform(0.0, step)
        read = step * np.round((exact + law(rng, share)) / step)
        out.append(left(share, read - exact, step))
    return out


@pytest.mark.parametrize("step", STEPS)
def test_growth_is_found_through_a_converter(step):
    found = [growth_of(records(growing, step, seed)) for seed in range(10)]
    # The variance at the greatest reading is 4 times that at none, for which the law has sqrt(3);
    # the straight line is below its curve in between.
    assert all(1.0 < growth < 2.6 for growth in found)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("law", [even, tailed])
def test_noise_that_is_as_loud_everywhere_does_not_grow(law, step):
    # The gain has to exceed half the log of 5,000 samples, 4.3: by chance at one number more, with
    # a probability below 0.002 a campaign (chi-square law of twice the gain).
    assert [growth_of(records(law, step, seed)) for seed in range(10)] == [0.0] * 10


def test_what_one_record_alone_shows_is_no_growth():
    told = records(even, 0.2, 3)
    one = told[0]
    told[0] = left(one.share, one.residual * (1.0 + 3.0 * one.share), 0.2)
    assert growth_of(told[:1]) > 0.0
    assert growth_of(told) == 0.0


def test_what_is_missing_is_no_growth():
    missing = 4.0 * np.sin(np.arange(SAMPLES) / 30.0)
    told = [
        left(one.share, one.residual + missing * one.share, 0.2) for one in records(even, 0.2, 4)
    ]
    assert growth_of(told) == 0.0


def test_what_is_loud_where_a_few_readings_are_large_is_no_growth():
    """As just after a release, where a sensor that swings too fast for its samples looks white."""
    rng = np.random.default_rng(5)

    def two(share: np.ndarray) -> list[Left]:
        return [left(share, (1.0 + 8.0 * share) * even(rng, share), 0.2) for _ in range(2)]

    assert growth_of(two(np.exp(-np.arange(SAMPLES) / 50.0))) == 0.0
    assert growth_of(two(np.exp(-np.arange(SAMPLES) / 500.0))) > 0.0


def sums_of_scores(one: Left, weight: np.ndarray) -> np.ndarray:
    """Scores of stretches, by the information that they are said to have, at the best level."""
    levels = jnp.geomspace(0.4, 4.0, 41)[:, None]
    heights = np.asarray(sample_law(levels, one.step, 17)(jnp.asarray(one.residual)).value) @ weight
    best = sample_law(levels[int(np.argmax(heights))], one.step, 17)(jnp.asarray(one.residual))
    summed = (weight * np.asarray(best.slope)).reshape(-1, STRETCH).sum(axis=1)
    known = (-weight * np.asarray(best.curvature)).reshape(-1, STRETCH).sum(axis=1)
    return summed / np.sqrt(np.maximum(known, 1e-300))


@pytest.mark.parametrize("step", STEPS)
def test_large_readings_are_as_far_off_as_their_weights_say(step):
    weighed, taken_even, law = [], [], 1.0 + (TRIED[np.argmin(np.abs(TRIED - 1.7))]) ** 2
    for seed in range(10):
        for one in records(growing, step, 50 + seed):
            variance = 1.0 + (law - 1.0) * one.share**2
            weight = np.mean(1.0 / variance) ** -1 / variance
            far = np.add.reduceat(one.share, np.arange(0, SAMPLES, STRETCH)) > 0.8 * STRETCH
            weighed.append(sums_of_scores(one, weight)[far])
            taken_even.append(sums_of_scores(one, np.ones(SAMPLES))[far])
    # Some 480 stretches: an sd of one is told to 3 %, a few times that leaves room for the law,
    # whose noise there is up to a tenth louder or quieter than the straight line's.
    assert 0.85 < np.std(np.concatenate(weighed)) < 1.12
    assert np.std(np.concatenate(taken_even)) > 1.2
