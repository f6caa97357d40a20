import numpy as np
import pytest

from rigid.io.errors import InputError
from rigid.records.defects import NAMES
from rigid.spec import Stretch

SHUT_HALFWAY = (Stretch(until=1.0, position="open"), Stretch(position="shut"))


def test_a_good_record_has_no_defects(bench):
    record = bench.read(bench.good())
    assert record.notes == ()
    assert all(channel.valid.all() for channel in record.channels.values())
    assert record.uniform


def spoil_gap(c):
    return {name: np.delete(values, slice(100, 110)) for name, values in c.items()}


def spoil_nan(c):
    c["load"][[50, 51, 52, 90]] = np.nan
    return c


def spoil_time_nan(c):
    c["time"][50] = np.nan
    return c


def spoil_back(c):
    c["time"][200:] -= 1.5
    return c


def spoil_dead(c):
    c["load"][:] = 31.5
    return c


def spoil_frozen(c):
    c["stroke"][100:320] = c["stroke"][100]
    return c


def spoil_left_behind(c):
    c["load"][180:] = c["load"][180]
    return c


def spoil_saturated(c):
    c["load"][300:310] = 300.0
    return c


def spoil_low_rail(c):
    c["load"][300:303] = -310.0
    return c


def spoil_large_unit(c):
    c["load"] *= 1000
    return c


def spoil_small_unit(c):
    c["pressure"] /= 1e5
    return c


def spoil_metres(c):
    c["stroke"] /= 1000
    return c


def spoil_milliseconds(c):
    c["time"] *= 1e4
    return c


def spoil_short(c):
    return {name: values[-15:] for name, values in c.items()}


DEFECTS = {
    "gap": ("gap", spoil_gap, "time: line 102: samples are missing, the time steps by 0.11 s"),
    "nan": ("nan", spoil_nan, "load: lines 52, 53, 54 and 1 more: no number was recorded"),
    "nan in the time": ("nan", spoil_time_nan, "time: no time in line 52"),
    "back": ("time-not-increasing", spoil_back, "the time does not increase, 0.5 s after 1.99 s"),
    "dead": ("stuck", spoil_dead, "load: lines 2 to 401: every sample reads 31500"),
    "frozen": ("stuck", spoil_frozen, "stroke: lines 102 to 321: reads"),
    "left behind": ("stuck", spoil_left_behind, "load: lines 182 to 401: reads"),
    "saturated": ("saturated", spoil_saturated, "load: lines 302 to 311, 10 samples in all"),
    "low rail": ("saturated", spoil_low_rail, "load: lines 302 to 304, 3 samples in all"),
    "large": ("unit", spoil_large_unit, "above 3e+06 N; the unit is given as 'kN', 'N'"),
    "small": ("unit", spoil_small_unit, "never 1000 Pa in a frame; the unit is given as 'bar'"),
    "metres": ("unit", spoil_metres, "stroke changes by 4.2e-06 m in all"),
    "milliseconds": ("unit", spoil_milliseconds, "sampling interval, 100 s, is implausibly long"),
    "short": ("too-short", spoil_short, "15 samples where at least 20 are needed"),
}


ALONG = {"large": ("saturated",), "nan in the time": ("gap",)}  # what else the same cause brings


@pytest.mark.parametrize("case", DEFECTS)
def test_each_defect_is_refused_and_can_be_accepted(case, bench):
    name, spoil, says = DEFECTS[case]
    columns = spoil(bench.good())
    message = bench.refusal(bench.read, columns)
    assert says in message
    assert f'accept = ["{name}"]' in message
    assert "r.csv: record 'r', " in message
    others = tuple(n for n in NAMES if n != name)
    assert says in bench.refusal(bench.read, columns, accept=others)
    accept = (name, *ALONG.get(case, ()))
    record = bench.read(columns, accept=accept)
    assert any(note.startswith(f"accepted ({name})") for note in record.notes)


def test_accepted_nan_and_saturated_samples_are_invalid(bench):
    columns = spoil_saturated(spoil_nan(bench.good()))
    record = bench.read(columns, accept=("nan", "saturated"))
    invalid = np.flatnonzero(~record.channels["load"].valid).tolist()
    assert invalid == [50, 51, 52, 90, *range(300, 310)]
    assert record.channels["stroke"].valid.all()


def test_an_accepted_gap_stays_on_the_grid(bench):
    record = bench.read(spoil_gap(bench.good()), accept=("gap",))
    assert record.uniform
    assert record.interval == pytest.approx(0.01, rel=1e-12)
    assert len(record.time) == 390


def test_accepted_steps_back_are_dropped(bench):
    record = bench.read(spoil_back(bench.good()), accept=("time-not-increasing",))
    assert np.all(np.diff(record.time) > 0)
    assert any("samples without increasing time were dropped" in note for note in record.notes)


def test_accepted_samples_without_time_are_dropped(bench):
    record = bench.read(spoil_time_nan(bench.good()), accept=("nan", "gap"))
    assert len(record.time) == 399


def test_all_defects_are_told_at_once(bench):
    message = bench.refusal(bench.read, spoil_gap(spoil_saturated(spoil_nan(bench.good()))))
    assert [line.rsplit('"', 2)[1] for line in message.splitlines()] == ["gap", "nan", "saturated"]


# What must not be refused


def test_two_samples_at_the_rail_are_no_saturation(bench):
    columns = bench.good()
    columns["load"][300:302] = 300.0
    assert bench.read(columns).channels["load"].valid.all()


def test_readings_beyond_the_rail_tell_of_unit_and_range(bench):
    columns = bench.good()
    columns["load"][300:310] = 600.0
    with pytest.raises(InputError, match=r"6e\+05 N, beyond the end .* 3e\+05 N; .*unit 'kN'"):
        bench.read(columns)


def test_noise_about_a_reading_near_the_rail_is_no_saturation(bench):
    columns = bench.good(900)  # the rail lies 0.75 sds of the noise above the reading
    columns["load"][200:] = np.random.default_rng(4).normal(299.4, 0.8, 700)
    with pytest.raises(InputError, match="at the end of its range"):
        bench.read(columns)  # its sheet knows of 150 N of noise, which would not reach so far
    loud = bench.sensors["load"].model_copy(update={"noise": 800.0})
    bench.sensors = bench.sensors | {"load": loud}
    assert bench.read(columns).channels["load"].valid.all()
    columns["load"][300:330] = 300.0
    with pytest.raises(InputError, match="30 samples in all"):
        bench.read(columns)


def test_a_gauge_may_rest_at_the_lower_end_zero(bench):
    columns = bench.good()
    columns["pressure"][:100] = 0.0
    assert bench.read(columns).channels["pressure"].valid.all()


def test_a_coarse_channel_may_repeat_itself_in_a_hold(bench):
    columns = bench.good(600)
    for name in ("load", "stroke", "pressure"):
        columns[name][110:590] = columns[name][110]
    assert bench.read(columns, valve=SHUT_HALFWAY).notes == ()


def test_load_may_rest_while_the_plunger_travels(bench):
    columns = bench.good(800)
    columns["load"][:500] = 0.0
    columns["pressure"][:500] = np.minimum(columns["pressure"][:500], 9.0)
    columns["pressure"][500:] = 9.0 + columns["pressure"][500:] - columns["pressure"][500]
    columns["load"][500:] -= columns["load"][500] - 0.295
    assert bench.read(columns).notes == ()


def test_a_free_run_may_carry_no_load(bench):
    columns = bench.good()
    columns["load"] = np.where(np.arange(400) % 50 == 0, 0.295, 0.0)
    columns["pressure"] = np.where(np.arange(400) % 40 == 0, 0.3, 0.0)
    assert bench.read(columns, kind="free-run").notes == ()


def test_a_coarse_stroke_may_stand_still_in_a_short_release(bench):
    count = np.arange(100)
    columns = {
        "time": count * 0.001,
        "acceleration": np.sin(count),
        "stroke": np.zeros(100),
    }
    record = bench.read(columns, kind="release", preload={"value": 6000.0, "sd": 60.0})
    assert record.notes == ()
