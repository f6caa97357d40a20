"""What a converter did: its step, and the end of its range that no sheet tells."""

from pathlib import Path

import numpy as np
import pytest

from rigid.records.converter import coarseness, ends, longest_run, without_ends
from rigid.records.record import Channel, Record
from rigid.spec import SensorSpec

SHEET = SensorSpec(step=3.0, noise=1.0, gain_sd=1e-3, zero_sd=2.0, range=(-1e3, 1e3))


@pytest.mark.parametrize(("multiple", "found"), [(1, 1), (2, 2), (3, 3), (17, 1)])
def test_a_converter_coarser_than_its_sheet_is_found_out(multiple: int, found: int):
    """Its codes stand on every other step, or every third; a common shift changes nothing."""
    rng = np.random.default_rng(500 + multiple)
    codes = 5 + multiple * rng.integers(0, 40, 300)
    assert coarseness([295.0 * codes, 295.0 * codes[::-1]], 295.0) == found
    assert coarseness([np.zeros(300)], 2.2e-4) == 1  # a channel that never moves says nothing
    assert coarseness([295.0 * codes], 0.0) == 1


def peak(rng: np.random.Generator) -> np.ndarray:
    """A pressure that rises fast, turns at 150 and falls off slowly: noise added, no converter."""
    t = np.arange(400.0)
    return np.where(t < 100, 1.5 * t, 150.0 - 0.3 * (t - 100)) + rng.standard_normal(400)


def converted(readings: np.ndarray, top: float) -> Channel:
    values = 3.0 * np.round(np.minimum(readings, top) / 3.0)
    return Channel("pressure", values, np.ones(len(values), dtype=bool), "p", "Pa")


def test_the_end_of_a_range_is_told_from_a_peak():
    """Of 40 peaks none is taken for an end; cut off at 141, where they stay for 36 samples, all."""
    rng = np.random.default_rng(510)
    for _ in range(40):
        readings = peak(rng)
        ((whole, _),) = ends([converted(readings, np.inf)], SHEET)
        assert not whole.any()
        ((stuck, end),) = ends([converted(readings, 141.0)], SHEET)
        assert end == 141.0
        # All that lay beyond by more than the noise, and nothing far below: the code 141 begins at
        # 139.5, four sds of noise from 135.5, and one sample to each side goes along.
        assert stuck[96:125].all()
        assert not stuck[:90].any()
        assert not stuck[160:].any()


def test_the_lower_end_is_one_only_where_it_is_no_rest():
    """A gauge rests at 0; one that stands at -141, seventy zero sds below it, is at its end."""
    rng = np.random.default_rng(511)
    mirrored = converted(peak(rng), 141.0)
    below = Channel("pressure", -mirrored.values, mirrored.valid, "p", "Pa")
    ((stuck, end),) = ends([below], SHEET)
    assert stuck[96:125].all()
    assert end == -141.0
    resting = Channel("pressure", below.values + 141.0, below.valid, "p", "Pa")
    ((stuck, _),) = ends([resting], SHEET)
    assert not stuck[96:125].any()


def test_how_long_a_run_may_be():
    """In the middle of a code 3 sds wide a reading stays with probability 0.8664."""
    assert longest_run(1.0, 3.0) == pytest.approx(np.log(0.2) / np.log(0.86639), rel=1e-4)
    assert longest_run(1.0, 0.0) == 6.0  # a fine converter repeats nothing
    assert longest_run(0.0, 3.0) == np.inf  # without noise a rest cannot be told from an end
    assert longest_run(0.01, 3.0) == np.inf


def record(name: str, channel: Channel) -> Record:
    time = 0.01 * np.arange(len(channel.values))
    return Record(
        name=name, kind="frame", cylinder="A", path=Path(f"{name}.csv"), sha256="", time=time,
        channels={"pressure": channel}, valve=(), preload=None, release_time=None, interval=0.01,
        uniform=True,
    )  # fmt: skip


def test_samples_at_an_end_are_not_used_and_the_record_says_so():
    """The end is that of the sensor: a lower peak of another record is no end."""
    rng = np.random.default_rng(512)
    high, low = converted(peak(rng), 141.0), converted(0.5 * peak(rng), np.inf)
    cut, whole = without_ends(
        (record("frame-1", high), record("frame-2", low)), {"pressure": SHEET}
    )
    channel = cut.channels["pressure"]
    assert not channel.valid[96:125].any()
    np.testing.assert_array_equal(channel.values, high.values)
    assert len(cut.notes) == 1
    assert "pressure: " in cut.notes[0]
    assert "stands at 141 (SI)" in cut.notes[0]
    assert whole.notes == ()
    assert whole.channels["pressure"].valid.all()
