"""How correlated noise is, though hundreds of traces have explained a part of it."""

import numpy as np
import pytest
from scipy.signal import lfilter

from rigid.likelihood.noise_spectrum import NoiseLaw
from rigid.localfit.local import LocalFit
from rigid.localfit.noise import leftover
from rigid.localfit.noise.leftover import (
    TRACE_SD,
    Explaining,
    Traces,
    left_by,
    noise_laws,
)
from rigid.localfit.samples import ChannelKey, Layout, Terms

SAMPLES, CHANNELS, TRACES, RHO = 1000, 12, 40, 0.6
TIME = (1.0 + RHO) / (1.0 - RHO)
NUMBER = np.repeat(np.arange(CHANNELS), SAMPLES)
ROWS = [n == NUMBER for n in range(CHANNELS)]
GOOD = np.ones(len(NUMBER), dtype=bool)


def noise(rho: float, seed: int) -> np.ndarray:
    white = np.random.default_rng(seed).standard_normal((CHANNELS, SAMPLES + 100))
    coloured = np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=1))
    return coloured[:, 100:].ravel()


def explaining(score: np.ndarray) -> Explaining:
    """Bumps over the time of each channel: they take the slow part of the noise."""
    place = np.linspace(0.0, 1.0, SAMPLES)
    centres = np.linspace(0.0, 1.0, TRACES)
    own = np.maximum(0.0, 1.0 - np.abs(place[:, None] - centres) * (TRACES - 1))
    own /= np.linalg.norm(own, axis=0)
    columns = np.kron(np.eye(CHANNELS), own)
    one = np.ones(columns.shape[1])
    parts, products = (columns,), columns.T @ columns
    curvature, precision = np.ones(len(score)), one / TRACE_SD**2
    return Explaining(score, curvature, parts, products, one, 0.0 * one, precision)


def times(explaining: Explaining, rows: list[np.ndarray], good: np.ndarray) -> list[float]:
    return [one.law.time for one in left_by(explaining, rows, good)]


def test_noise_keeps_its_correlation_though_traces_explain_the_slow_part(monkeypatch):
    found = np.array(times(explaining(noise(RHO, 1)), ROWS, GOOD))
    # d log tau / d rho = 2/(1 - rho^2), sd of rho sqrt((1 - rho^2)/n): 8 % a channel. Noise whose
    # slow part is gone says half of that, and orders are chosen: twice as much; 12 channels: 5 %.
    assert found.mean() == pytest.approx(TIME, rel=3 * 0.05)
    monkeypatch.setattr(leftover, "ROUNDS", 0)
    careless = np.array(times(explaining(noise(RHO, 1)), ROWS, GOOD))
    assert careless.mean() < 0.85 * TIME


def test_white_noise_stays_white():
    found = times(explaining(noise(0.0, 2)), ROWS, GOOD)
    assert np.mean(found) == pytest.approx(1.0, abs=0.05)


def test_a_trace_where_no_sample_tells_explains_nothing():
    rng = np.random.default_rng(4)
    bend, design = np.repeat((1.0, 0.0), 100), rng.normal(size=(200, 2))
    local = object.__new__(LocalFit)
    vars(local).update(
        terms=Terms(np.zeros(200), bend * rng.normal(size=200), bend), design=design, w=np.zeros(2)
    )
    told, silent = rng.normal(size=(200, 1)), np.repeat((0.0, 1.0), 100)[:, None]
    both = Explaining.by(local, np.concatenate([told, silent], axis=1))
    np.testing.assert_allclose(both.left, Explaining.by(local, told).left, atol=1e-12)


def test_samples_that_do_not_count_say_nothing():
    good = GOOD & ~ROWS[3]
    score = np.where(good, noise(RHO, 3), 1e6)
    score[ROWS[3]] = 0.0
    found = np.array(times(explaining(score), ROWS, good))
    assert found[3] == 1.0
    assert np.delete(found, 3).mean() == pytest.approx(TIME, rel=3 * 0.05)


def with_bumps(
    score: np.ndarray, each: int = CHANNELS, alone: bool = True
) -> tuple[LocalFit, Traces]:
    """Records with bumps over the time of each.

    - `each`: how many records a sensor has. - `alone`: whether the bumps are the sensor's own.
    """
    made = explaining(score)
    channels = tuple(
        ChannelKey(f"record-{n},A", "frame", "load", f"load-{n // each},A", 0.01)
        for n in range(CHANNELS)
    )
    layout = object.__new__(Layout)
    vars(layout).update(channels=channels, channel=NUMBER)
    local = object.__new__(LocalFit)
    terms = Terms(np.zeros(len(score)), score, np.ones(len(score)))
    vars(local).update(terms=terms, layout=layout, w=np.zeros(0), design=np.zeros((len(score), 0)))
    columns = made.parts[0]
    every = np.ones(columns.shape[1], dtype=bool)
    return local, Traces(columns, every, every & alone)


def laws(local: LocalFit, traces: Traces) -> list[NoiseLaw]:
    return noise_laws(local, Explaining.by(local, traces.columns), traces, GOOD)


def test_what_wanders_in_all_records_of_a_sensor_is_noise():
    slow = np.sqrt(0.7) * noise(0.0, 5) + np.sqrt(0.3) * noise(0.97, 6)
    for alone in (True, False):
        found = [law.time for law in laws(*with_bumps(slow, alone=alone))]
        # 0.7 + 0.3 (1 + 0.97)/(1 - 0.97) = 20.4; eleven records tell it to a fifth (five other
        # seeds gave 15 to 23 for all twelve), and the slower of two laws is taken
        assert 10.0 < np.median(found) < 41.0


def test_what_wanders_in_the_only_record_of_a_sensor_is_noise_unless_it_moves_others_too():
    slow = np.sqrt(0.7) * noise(0.0, 5) + np.sqrt(0.3) * noise(0.97, 6)
    wanders = [law.time for law in laws(*with_bumps(slow, 1))]
    # as above, but each record by itself: a factor of two
    assert 5.0 < np.median(wanders) < 82.0
    # explained, it leaves what is white
    moves = [law.time for law in laws(*with_bumps(slow, 1, alone=False))]
    assert np.median(moves) < 2.0


def test_what_wanders_in_one_record_is_not():
    white = noise(0.0, 7)
    white[ROWS[2]] += 1.5 * np.sin(np.linspace(0.0, 3.0 * np.pi, SAMPLES))
    found = [law.time for law in laws(*with_bumps(white))]
    assert found[2] < 1.5


def test_what_wanders_in_one_record_of_three_is_not_noise():
    white = noise(0.0, 7)
    white[ROWS[2]] += 1.5 * np.sin(np.linspace(0.0, 3.0 * np.pi, SAMPLES))
    found = [law.time for law in laws(*with_bumps(white, 3))]
    assert found[2] < 1.5


def test_a_channel_of_which_nothing_is_left_has_the_noise_of_its_sheet():
    """Its law is a number, whatever its sensor's other records do."""
    slow = np.where(ROWS[3], 0.0, np.sqrt(0.3) * noise(0.97, 6) + noise(0.0, 5))
    local, traces = with_bumps(slow)
    explaining, good = Explaining.by(local, traces.columns), GOOD & ~ROWS[3]
    found = noise_laws(local, explaining, traces, good)
    assert all(np.isfinite(one.variance) for one in found)
    told = noise_laws(local, explaining, traces, GOOD)
    assert np.isfinite(told[3].variance)
    assert told[3].variance > 0.0
