"""Bands in which records move the plunger, on motions whose spectrum is known."""

import numpy as np
import pytest

from rigid.inference.derived import ChannelDraws
from rigid.inference.excitation import excited


def channel(kind: str, quantity: str, time: np.ndarray, read: np.ndarray) -> ChannelDraws:
    same = np.broadcast_to(read, (5, len(read)))
    return ChannelDraws("r", "A", kind, quantity, time, read, same, same, 0.0 * read, 1.0, 0.0)


def ring(frequency: float, decay: float) -> ChannelDraws:
    time = np.arange(0.0, 1.2, 1.0 / 1650.0)
    after = np.maximum(time - 0.05, 0.0)
    velocity = np.sin(2 * np.pi * frequency * after) * np.exp(-after / decay)
    read = 0.3 + np.gradient(velocity, time)
    return channel("release", "acceleration", time, read)


def run(fast: float) -> ChannelDraws:
    time = np.arange(0.0, 30.0, 0.02)
    return channel("free-run", "stroke", time, fast * np.clip(time - 2.0, 0.0, 20.0))


def test_a_ring_excites_a_line_of_its_width():
    ((label, low, high),) = excited([ring(100.0, 0.15)])
    # A Lorentzian of half width 1/(2 pi decay) holds nine tenths within 6.3 of them.
    width = 6.3 / (2 * np.pi * 0.15)
    assert label == "release"
    assert 100.0 - width - 3.0 < low < 100.0 < high < 100.0 + width + 3.0


def test_a_zero_that_is_off_excites_nothing():
    still = ring(100.0, 0.05)
    assert excited([still])[0][1] > 60.0


def test_a_steady_run_excites_what_its_length_resolves():
    ((_, low, high),) = excited([run(1e-3)])
    assert low == pytest.approx(0.5 / 30.0, rel=0.01)
    assert high < 1.0 / 20.0 + 1.0 / 30.0


def test_kinds_come_apart_and_records_together():
    found = excited([ring(70.0, 0.05), ring(240.0, 0.05), run(1e-3)])
    assert [label for label, _, _ in found] == ["free run", "release"]
    assert found[1][1] < 70.0
    assert found[1][2] > 240.0


def test_records_without_stroke_and_acceleration_tell_nothing():
    load = channel("frame", "load", np.arange(10) * 0.02, np.arange(10.0))
    assert excited([load]) == ()
