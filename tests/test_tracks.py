"""Records laid on their grid: gaps, valve programmes, releases."""

from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, effects

from rigid.io.errors import InputError
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.tracks import MOST_SWITCHES, QUIET_LEAD, ROUND_TO, Series, make_track
from rigid.records.record import Channel, Record
from rigid.spec import Known, Stretch

SHUT = (Stretch(position="shut"),)


def record(kind: str, quantity: str, values: np.ndarray, **more) -> Record:
    interval = 1 / 1600 if kind == "release" else 0.01
    time = 100.0 + interval * np.arange(len(values))
    channel = Channel(quantity, values, np.isfinite(values), quantity, "SI")
    given = {
        "name": "one",
        "kind": kind,
        "cylinder": "A",
        "path": Path("one.csv"),
        "sha256": "0",
        "time": time,
        "channels": {quantity: channel},
        "valve": SHUT,
        "preload": None,
        "release_time": None,
        "interval": interval,
        "uniform": True,
    }
    return Record(**given | more)


def test_gaps_and_missing_samples_have_no_weight():
    values = np.arange(8.0)
    values[2] = np.nan
    time = 100.0 + 0.01 * np.array([0, 1, 2, 3, 6, 7, 8, 9])
    track, series = make_track(record("free-run", "stroke", values, time=time))
    assert track.samples == 10
    np.testing.assert_array_equal(series.weight["stroke"], [1, 1, 0, 1, 0, 0, 1, 1, 1, 1])
    np.testing.assert_array_equal(series.data["stroke"], [0, 1, 0, 3, 0, 0, 4, 5, 6, 7])
    np.testing.assert_allclose(track.times, 100.0 + 0.01 * np.arange(10))


def test_uneven_samples_are_refused():
    with pytest.raises(InputError, match="not evenly spaced"):
        make_track(record("free-run", "stroke", np.arange(8.0), uniform=False))


def test_valve_programme_becomes_levels():
    valve = (
        Stretch(until=99.0, position="shut"),  # over before the record begins
        Stretch(until=101.0, position="open"),
        Stretch(until=102.0, position="shut"),
        Stretch(until=102.5, position="tank"),
        Stretch(until=103.0, position="open"),
        Stretch(position="tank"),
    )
    stroke = np.linspace(0.0, 0.04, 401)
    track, _ = make_track(record("frame", "stroke", stroke, valve=valve))
    assert tuple(track.drive.switches) == (101.0, 102.0, 102.5, 103.0)
    assert track.drive.levels == (1, 0, 2, 1, 3)
    assert track.open_levels == (1, 2, 3)


def test_too_many_switches_are_refused():
    stretches = [
        Stretch(until=100.0 + 0.1 * (i + 1), position=("open", "shut")[i % 2])
        for i in range(MOST_SWITCHES + 1)
    ]
    with pytest.raises(InputError, match=f"at most {MOST_SWITCHES}"):
        make_track(record("frame", "stroke", np.zeros(200), valve=(*stretches, SHUT[0])))


def ringing(onset: int, samples: int = 500, offset: float = 9.8) -> np.ndarray:
    rng = np.random.default_rng(41)
    k = np.arange(samples - onset)
    swing = 45.0 * np.cos(2 * np.pi * k / 22) * np.exp(-k / 60)
    return offset + np.concatenate([np.zeros(onset), swing]) + 0.35 * rng.standard_normal(samples)


@pytest.mark.parametrize("onset", [16, 100, 311])
def test_release_is_found_and_cut_to_a_fixed_lead(onset: int):
    values = ringing(onset)
    track, series = make_track(record("release", "acceleration", values))
    assert track.onset == QUIET_LEAD
    assert float(track.onset_time) == pytest.approx(100.0 + onset / 1600)
    assert track.samples % ROUND_TO == 0
    data, weight = series.data["acceleration"], series.weight["acceleration"]
    count = int(weight.sum())
    assert count == QUIET_LEAD + len(values) - onset
    np.testing.assert_array_equal(data[:count], values[onset - QUIET_LEAD :])
    assert not data[count:].any()


def test_release_soon_after_the_start_keeps_its_lead_without_weight():
    track, series = make_track(record("release", "acceleration", ringing(5)))
    assert track.onset == QUIET_LEAD
    weight = series.weight["acceleration"]
    np.testing.assert_array_equal(weight[: QUIET_LEAD - 5], 0.0)
    assert weight[QUIET_LEAD - 5 :][:100].all()


def test_release_at_a_given_instant():
    at = Known(value=100.0 + 200.4 / 1600, sd=0.0)
    track, _ = make_track(record("release", "acceleration", ringing(201), release_time=at))
    assert float(track.onset_time) == pytest.approx(100.0 + 201 / 1600)


def test_noise_alone_is_no_release():
    noise = 0.35 * np.random.default_rng(42).standard_normal(400)
    noise[300] = 1.5
    with pytest.raises(InputError, match="no release stands out"):
        make_track(record("release", "acceleration", noise))


def test_release_without_acceleration_is_refused():
    with pytest.raises(InputError, match="needs a channel 'acceleration'"):
        make_track(record("release", "load", np.zeros(100)))


def test_series_are_padded_and_cut():
    series = Series({"load": np.arange(1.0, 6.0)}, {"load": np.ones(5)})
    data, weight = series.padded("load", 7)
    np.testing.assert_array_equal(data, [1, 2, 3, 4, 5, 0, 0])
    np.testing.assert_array_equal(weight, [1, 1, 1, 1, 1, 0, 0])
    np.testing.assert_array_equal(series.cut(-2, 4).data["load"], [0, 0, 1, 2])
    np.testing.assert_array_equal(series.cut(3, 4).data["load"], [4, 5, 0, 0])
    assert series.has("load")
    assert not series.has("stroke")


@pytest.mark.slow
def test_records_that_differ_in_length_and_valve_times_share_a_program():
    """One trace for both where sizes are kept; with grids as long as the records there are two."""
    traces = []

    @eqx.filter_jit
    def predicted(group, values):
        traces.append(group.samples)
        return group.predict(values)["load"]

    def group(samples: int, switch: float, exact: bool) -> SlowGroup:
        valve = (Stretch(until=switch, position="open"), Stretch(position="shut"))
        track, _ = make_track(record("frame", "load", np.zeros(samples), valve=valve))
        return SlowGroup((track.on_grid(samples) if exact else track,), effects(BASE))

    values = {k: jnp.asarray([v]) for k, v in (NOMINAL | {"kappa[one,A]": 0.2}).items()}
    for exact, most in ((True, 2), (False, 1)):
        one, other = group(66, 100.302, exact), group(75, 100.205, exact)
        loads = [np.asarray(predicted(g, values))[:, 0, 0] for g in (one, other)]
        assert len(traces) == most
        traces.clear()
        assert loads[0][60] > 1.2 * loads[1][60]  # open for longer
