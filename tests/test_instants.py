"""Jitter of a logger's instants, told by other records than the one that it is asked of."""

import numpy as np
import pytest

from rigid.localfit.local import LocalFit
from rigid.localfit.noise.instants import asked_for, louder
from rigid.localfit.samples import ChannelKey, Layout, Terms

SAMPLES, RECORDS, INTERVAL, SIGMA = 800, 4, 0.01, 0.05
NUMBER = np.repeat(np.arange(RECORDS), SAMPLES)
TIME = np.tile(INTERVAL * np.arange(SAMPLES), RECORDS)
GOOD = np.ones(len(NUMBER), dtype=bool)


def reading(time: np.ndarray) -> np.ndarray:
    """Still for half of a record, then up and down by 1 within some samples."""
    return np.where(time < 4.0, 0.0, np.sin(2.0 * np.pi * 2.0 * (time - 4.0)))


def left(
    jitter: float, only: int | None = None, lag: float = 0.0, lone: bool = False
) -> tuple[LocalFit, np.ndarray]:
    """A fit, and scores of readings whose instants jitter by so many intervals.

    - `only`: in one record. - `lag`: all of them are late by so many intervals. - `lone`: each
      record has an interval of its own.
    """
    rng = np.random.default_rng(41)
    late = INTERVAL * (jitter * rng.standard_normal(len(TIME)) - lag)
    late[(only is not None) & (only != NUMBER)] = 0.0
    residual = reading(TIME + late) - reading(TIME) + SIGMA * rng.standard_normal(len(TIME))
    channels = tuple(
        ChannelKey(f"record-{n},A", "frame", "load", "load,A", INTERVAL * (1.0 + lone * 1e-9 * n))
        for n in range(RECORDS)
    )
    layout = object.__new__(Layout)
    weight = np.ones(len(TIME))
    vars(layout).update(channels=channels, channel=NUMBER, time=TIME, weight=weight)
    known = np.full(len(TIME), SIGMA**-2.0)
    local = object.__new__(LocalFit)
    vars(local).update(
        layout=layout, reading=reading(TIME), terms=Terms(0.0 * TIME, residual * known, known)
    )
    return local, residual * known


def test_jitter_makes_steep_readings_count_less():
    jitter = 0.3
    found = louder(*left(jitter), GOOD)
    rate = np.gradient(reading(TIME[:SAMPLES]), INTERVAL)
    expected = 1.0 + (jitter * INTERVAL * rate / SIGMA) ** 2
    assert found[:300].max() == 1.0  # where nothing moves
    # 1,200 steep samples tell the excess variance, half of the whole, to a tenth or so
    inside = slice(402, SAMPLES - 1)  # neither where the motion sets in nor at the end
    ratio = (found[:SAMPLES] - 1.0)[inside].max() / (expected - 1.0)[inside].max()
    assert 0.7 < ratio < 1.4


def test_a_sample_at_a_bend_is_off_by_half_of_the_jump():
    """Its instant may be in the midst of it; where nothing jitters it is off by nothing."""
    local, score = left(0.3)
    found = louder(local, score, GOOD)[:SAMPLES]
    jump = np.abs(np.diff(reading(TIME[:SAMPLES])))
    for at, step in ((400, jump[400]), (SAMPLES - 1, jump[-1])):
        assert found[at] == pytest.approx(1.0 + (0.5 * step / SIGMA) ** 2)


def test_records_of_another_interval_tell_where_its_own_do_not():
    """Nothing is left of the record itself, as in a release; three others have one interval."""
    local, score = left(0.3)
    layout = local.layout
    alone = layout.channels[3]._replace(interval=0.1 * INTERVAL)
    other = object.__new__(Layout)
    vars(other).update(vars(layout) | {"channels": (*layout.channels[:3], alone)})
    vars(local).update(layout=other)
    explained = np.where(NUMBER == 3, 0.0, score)
    found, shared = louder(local, explained, GOOD), louder(*left(0.3), GOOD)
    mine = np.flatnonzero(NUMBER == 3)[402:-1]
    assert 0.4 < (found[mine] - 1.0).max() / (shared[mine] - 1.0).max() < 2.5


def test_scatter_that_asks_for_more_than_half_an_interval_is_no_jitter():
    np.testing.assert_array_equal(louder(*left(3.0), GOOD), 1.0)


def test_without_jitter_all_samples_count():
    np.testing.assert_array_equal(louder(*left(0.0), GOOD), 1.0)


def test_what_one_record_does_is_no_jitter_of_it():
    found = louder(*left(0.3, only=2), GOOD)
    np.testing.assert_array_equal(found[NUMBER == 2], 1.0)


def test_the_only_record_of_an_interval_jitters_if_it_does_so_by_chance():
    """Nothing of it is left once everything is explained; it is asked before."""
    local, score = left(0.3, lone=True)
    found = louder(local, 0.0 * score, GOOD)
    shared = louder(*left(0.3), GOOD)
    for number in range(RECORDS):
        mine = number == NUMBER
        # a quarter of the samples of the first test: twice the error
        assert 0.4 < (found[mine] - 1.0).max() / (shared[mine] - 1.0).max() < 2.5
    late, score = left(0.0, lag=0.6, lone=True)
    np.testing.assert_array_equal(louder(late, 0.0 * score, GOOD), 1.0)


def test_scores_ask_for_jitter_that_signatures_would_explain_away():
    local, score = left(0.3, lone=True)
    assert louder(local, 0.0 * score, GOOD).max() > 1.0  # its own scores are asked there, too
    local, score = left(0.3)
    assert louder(local, 0.0 * score, GOOD).max() == 1.0
    asked, told = asked_for(local), louder(local, score, GOOD)
    # variances of 3,200 samples scatter by 0.2 of their mean: a quarter of its square each, 32
    assert 15.0 < asked.log_bayes < 60.0
    ratio = (asked.variance[402:799].max() - 1.0) / (told[402:799].max() - 1.0)
    assert 0.8 < ratio < 1.25


def test_nothing_is_asked_for_where_nothing_jitters_or_what_jitters_is_reckoned_with():
    assert asked_for(left(0.0)[0]) is None
    local, score = left(0.3)
    vars(local.layout).update(weight=1.0 / louder(local, score, GOOD))
    assert asked_for(local) is None
