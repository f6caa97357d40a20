"""The likelihood of a fit whose noise follows it, beside the one that fits are led by."""

import numpy as np
import pytest
from scipy.signal import lfilter

from rigid.localfit.local import LocalFit
from rigid.localfit.noise.follows import POOLED, log_likelihood, pooled, pooled_by
from rigid.localfit.samples import ChannelKey, Layout, Terms

SAMPLES, CHANNELS, SIGMA = 2000, 2, 0.3
NUMBER = np.repeat(np.arange(CHANNELS), SAMPLES)
PLACE = np.tile(np.arange(SAMPLES), CHANNELS)


def fit(residual: np.ndarray) -> LocalFit:
    """A fit that leaves residuals, in sds of a noise that is taken for white."""
    channels = tuple(
        ChannelKey(f"record-{n},A", "frame", "load", "load,A", 0.01) for n in range(CHANNELS)
    )
    layout = object.__new__(Layout)
    floor = np.full(len(NUMBER), SIGMA)
    even = {"weight": np.ones(len(NUMBER)), "loud": np.ones(len(NUMBER))}
    vars(layout).update(channels=channels, channel=NUMBER, floor=floor, **even)
    known = np.full(len(NUMBER), SIGMA**-2.0)
    local = object.__new__(LocalFit)
    terms = Terms(-0.5 * known * residual**2, residual * known, known)
    vars(local).update(layout=layout, residual=residual, terms=terms)
    return local


def noise(memory: float, seed: int) -> np.ndarray:
    """Noise of the stated sd whose neighbours resemble each other."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((CHANNELS, SAMPLES + 200))
    found = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white)[:, 200:]
    return SIGMA * found.ravel()


def test_of_white_noise_both_likelihoods_say_the_same():
    """A ripple of a strength of 10: 50 nats with a standard deviation of 10."""
    left = noise(0.0, 3)
    ripple = np.sin(0.3 * PLACE)
    ripple *= 10.0 * SIGMA / np.linalg.norm(ripple)
    before, after = fit(left + ripple), fit(left)
    gain = float(after.terms.value.sum() - before.terms.value.sum())
    followed = log_likelihood(after) - log_likelihood(before)
    assert gain == pytest.approx(50.0, abs=30.0)
    # Whittle's classes of frequencies are wider than a line; its level is free.
    assert followed == pytest.approx(gain, abs=0.25 * gain)
    assert pooled(before, after) == pytest.approx(POOLED * (followed - gain))


def test_what_takes_the_slow_part_of_correlated_residuals_explains_little():
    """As independent samples they would be explained better by 600 nats and more."""
    left = noise(0.98, 5)
    kernel = np.ones(201) / 201.0
    slow = np.concatenate([np.convolve(one, kernel, "same") for one in left.reshape(CHANNELS, -1)])
    before, after = fit(left), fit(left - slow)
    gain = float(after.terms.value.sum() - before.terms.value.sum())
    followed = log_likelihood(after) - log_likelihood(before)
    assert gain > 600.0
    assert followed < 0.1 * gain
    assert pooled(before, after) < -0.4 * gain
    assert pooled_by(before, [slow]) == pytest.approx([pooled(before, after)])


def test_what_leaves_white_noise_of_correlated_residuals_explains_more():
    """Samples that count for less, since the first fit's residuals were alike, tell of it."""
    left, missing = noise(0.0, 7), 2.0 * noise(0.995, 8)
    before, after = fit(left + missing), fit(left)
    # Of a fifth white noise and four fifths with a sum of autocorrelations of 399.
    tempered = 1.0 / (0.2 * 1.0 + 0.8 * 399.0)
    gain = tempered * float(after.terms.value.sum() - before.terms.value.sum())
    assert log_likelihood(after) - log_likelihood(before) > 3.0 * gain


def test_it_counts_twice_what_the_first_says_at_most():
    left = noise(0.0, 9)
    before = fit(left + noise(0.995, 10))
    vars(before)["terms"] = Terms(*(0.01 * part for part in before.terms))
    after = fit(left)
    vars(after)["terms"] = Terms(*(0.01 * part for part in after.terms))
    gain = float(after.terms.value.sum() - before.terms.value.sum())
    assert log_likelihood(after) - log_likelihood(before) > 2.0 * gain > 0.0
    assert pooled(before, after) == pytest.approx(POOLED * gain)
    # What explains nothing by the first explains nothing.
    assert pooled(after, after) == 0.0
    assert pooled(after, before) <= POOLED * gain


def test_channels_that_say_nothing_count_for_nothing():
    left = noise(0.5, 11)
    both, one = fit(left), fit(left)
    vars(one.layout)["weight"] = np.where(NUMBER == 0, 1.0, 0.0)
    still = fit(np.where(NUMBER == 0, left, 0.0))
    assert log_likelihood(one) == pytest.approx(log_likelihood(still))
    assert log_likelihood(both) != pytest.approx(log_likelihood(one))


def test_noise_that_is_known_to_be_louder_somewhere_says_as_much_as_even_noise():
    """Where it is taken for even, what it leaves there looks as if it said less of all the rest."""
    left, louder = noise(0.0, 11), np.where(0.5 * PLACE.max() < PLACE, 5.0, 1.0)
    ripple = np.sin(0.3 * PLACE) * (louder == 1.0)
    ripple *= 10.0 * SIGMA / np.linalg.norm(ripple)
    gains = {}
    for known in (True, False):
        two = [fit(one * louder) for one in (left + ripple, left)]
        for one in two:
            vars(one.layout).update(loud=louder**2 if known else np.ones(len(louder)))
        gains[known] = log_likelihood(two[1]) - log_likelihood(two[0])
    assert gains[True] == pytest.approx(50.0, abs=30.0)  # as in the first test
    assert gains[False] < 0.5 * gains[True]
