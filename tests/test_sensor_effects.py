"""Effects of sensors and of a shut valve, against filters and formulas outside the simulation."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, drive, effects, march_still, rig_of, track
from scipy.signal import cont2discrete, lfilter
from test_catalogue import BARS, RECORDS, SIGNATURES, SPRINGS, base, marched, simulated

from rigid.effects import CATALOGUE
from rigid.likelihood.groups import ReleaseGroup, SlowGroup
from rigid.physics import release, slow
from rigid.physics.drive import side_by_side

FINE = 20
"""Steps of a filter within a sample."""


def low_pass(series: np.ndarray, interval: float, time: float) -> np.ndarray:
    """A series (n,) through a filter of first order, a straight line between samples."""
    top, bottom, _ = cont2discrete(([1.0], [time, 1.0]), interval / FINE, method="foh")
    at = np.arange(len(series) * FINE - FINE + 1) / FINE
    fine = np.interp(at, np.arange(len(series)), series)
    return lfilter(np.ravel(top), bottom, fine)[::FINE]


def changed(name: str) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Channels of the effect's record without it, and how each changes."""
    values, kind, *_ = SIGNATURES[name]
    steady = CATALOGUE[name].steady
    reference, read = base(kind, steady), simulated(NOMINAL | values, (*BASE, name), kind, steady)
    return reference, {channel: read[channel] - series for channel, series in reference.items()}


@pytest.mark.slow
def test_a_cell_that_creeps_reads_a_share_of_the_load_late():
    reference, change = changed("load-cell-creep")
    values, interval = SIGNATURES["load-cell-creep"][0], RECORDS["frame"][0].interval
    late = low_pass(reference["load"], interval, values["tau_creep"])
    expected = values["creep"] * late
    # the valve moves within a sample, which a straight line between samples does not see
    np.testing.assert_allclose(change["load"], expected, atol=2e-3 * expected.max())


def loop(deflection: np.ndarray, width: float) -> np.ndarray:
    """Share of the loop along deflections (n,): Dahl's law in closed form for every stretch."""
    share = np.zeros(len(deflection))
    for i, moved in enumerate(np.diff(deflection)):
        end = np.sign(moved)
        share[i + 1] = end + (share[i] - end) * np.exp(-abs(moved) / width)
    return share


@pytest.mark.slow
def test_a_cell_with_hysteresis_reads_a_loop_that_stays_in_a_hold():
    """Pressed in, held, let back by half and held, at two speeds."""
    width, ends = 3e-4, []
    values = {"hysteresis": 400.0, "hysteresis_width": width}
    for slower in (1, 2):
        switches = tuple(slower * t + 0.053 for t in (0.0, 0.4, 0.6, 0.8))
        record = drive(110 * slower, switches, (0, 1, 0, 2, 0))
        levels = jnp.asarray((0.0, 0.12, -0.12))[:, None, None] / slower
        contact = jnp.asarray([NOMINAL["k_frame"]])
        plain, read = (
            marched(rig_of(NOMINAL | values, names, walkers=True), contact, levels, record, False)
            for names in (BASE, (*BASE, "load-cell-hysteresis"))
        )
        load = np.asarray(plain["load"])[:, 0, 0]
        change = np.asarray(read["load"])[:, 0, 0] - load
        expected = 400.0 * loop(load / NOMINAL["k_LC"], width)
        # Where the valve moves the load rings between samples, by a hundredth of the width.
        np.testing.assert_allclose(change, expected, atol=0.02 * 400.0)
        rise, fall = change[58 * slower : 63 * slower], change[100 * slower :]
        assert np.ptp(rise) < 0.01 * 400.0 > np.ptp(fall)
        # 0.82 mm in and half of it back: 1 - exp(-2.72), then -1 + 1.93 exp(-1.36).
        assert rise.mean() > 0.9 * 400.0
        assert fall.mean() < -0.45 * 400.0
        ends.append((rise.mean(), fall.mean()))
    np.testing.assert_allclose(*ends, atol=0.02 * 400.0)


@pytest.mark.slow
def test_a_gauge_that_lags_is_a_low_pass_of_the_pressure():
    reference, change = changed("pressure-gauge-lag")
    time, interval = SIGNATURES["pressure-gauge-lag"][0]["tau_gauge"], RECORDS["frame"][0].interval
    behind = low_pass(reference["pressure"], interval, time) - reference["pressure"]
    away = np.ones(90, dtype=bool)
    away[4:9] = away[49:54] = False  # where the valve moves within a sample
    # at 20 ms the millisecond that keeps it regular counts for an eighth of a percent
    np.testing.assert_allclose(
        change["pressure"][away], behind[away], atol=0.02 * np.abs(behind).max()
    )


@pytest.mark.slow
@pytest.mark.parametrize("march", [slow.march, march_still])
@pytest.mark.parametrize("kind", RECORDS)
def test_a_converter_that_averages_reads_the_mean_of_a_finer_record(march, kind):
    """By trapezoids at forty times the rate; the valve moves on a sample and within one."""
    record, contact, fractions = RECORDS[kind]
    parts, half = 40, 16
    record = dataclasses.replace(record, switches=[0.05, *record.switches[1:]])
    samples = (record.size - 1) * parts + 1
    fine = dataclasses.replace(
        record, interval=record.interval / parts, samples=samples, size=samples
    )
    levels = jnp.asarray(fractions)[:, None, None]

    def read(march, names, more, record):
        rig = rig_of(NOMINAL | more, names, walkers=True)
        out = eqx.filter_jit(march)(rig, jnp.asarray([contact]), levels, side_by_side((record,)))
        return {q: np.asarray(series)[:, 0, 0] for q, series in out.items()}

    values = {"averaged": 0.7, "aperture": 2 * half / parts}
    exact = read(slow.march, BASE, {}, fine)
    got = read(march, (*BASE, "sample-averaging"), values, record)
    weights = np.append(np.append(0.5, np.ones(2 * half - 1)), 0.5) / (2 * half)
    for channel, bar in BARS.items():
        mean = np.convolve(np.pad(exact[channel], half, mode="edge"), weights, "valid")[::parts]
        truth = exact[channel][::parts]
        expected = truth + 0.7 * (mean - truth)
        assert np.abs(got[channel] - expected)[:89].max() < bar, channel
    assert np.abs(mean - truth).max() > 5 * bar  # in the pressure, which is the last


@pytest.mark.slow
def test_sensors_pick_up_a_line_in_every_channel_of_every_record():
    """Above half the sampling frequency of a slow record, and below that of a release."""
    own = {"pickup": 40.0, "f_pickup": 59.3, "pickup_stroke": 5e-7, "pickup_pressure": 90.0,
           "pickup_acceleration": 3e-3}  # fmt: skip
    per_newton = {"load": 1.0, "stroke": 5e-7, "pressure": 90.0, "acceleration": 3e-3}
    slow_run = track("run-1,A", "free-run", 90, drive=RECORDS["free-run"][0])
    snap = track("snap-1,A", "release", 64)
    more = {"kappa[run-1,A]": 0.2, "kappa_tank[run-1,A]": -0.2, "preload[snap-1,A]": 6e3,
            "release_time[snap-1,A]": 0.0097}  # fmt: skip
    for group in (SlowGroup, ReleaseGroup):
        one = slow_run if group is SlowGroup else snap
        angles = {f"pickup_angle_{q}[{one.label}]": 1.0 + i for i, q in enumerate(group.quantities)}
        values = {k: jnp.asarray([v]) for k, v in (NOMINAL | own | more | angles).items()}
        plain = group((one,), effects(BASE)).predict(values)
        read = group((one,), effects((*BASE, "mains-pickup"))).predict(values)
        times = one.interval * np.arange(one.samples)
        for i, q in enumerate(group.quantities):
            line = 40.0 * per_newton[q] * np.sin(2.0 * np.pi * 59.3 * times + 1.0 + i)
            change = np.asarray(read[q] - plain[q])[: one.samples, 0, 0]
            np.testing.assert_allclose(change, line, atol=1e-6 * per_newton[q])


@pytest.mark.slow
def test_sensors_that_warm_up_settle_as_an_exponential():
    _, change = changed("temperature-drift")
    values, times = SIGNATURES["temperature-drift"][0], RECORDS["frame"][0].times
    load = values["thermal_load"] * -np.expm1(-times / values["tau_thermal"])
    np.testing.assert_allclose(change["load"], load, atol=1e-3 * load.max())
    np.testing.assert_allclose(
        change["pressure"],
        values["thermal_ratio"] * load,
        atol=1e-3 * values["thermal_ratio"] * load.max(),
    )


@pytest.mark.slow
def test_a_shut_valve_leaks_in_a_hold_and_not_under_the_pump():
    values = SIGNATURES["shut-valve-leakage"][0]
    reference, change = changed("shut-valve-leakage")
    pressure = reference["pressure"] + change["pressure"]
    assert np.abs(change["pressure"][:50]).max() < 1e-3 * pressure.max()
    area, mid = NOMINAL["S_Pl"], pressure[70:].mean()
    volume = area * (NOMINAL["L_0"] + area * mid * SPRINGS)
    rate = values["C_valve"] / (area**2 * SPRINGS + volume / NOMINAL["k_oil"])
    assert np.log(pressure[70] / pressure[89]) == pytest.approx(0.19 * rate, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("frequency", "share"), [(265.0, 1.0), (1500.0, 0.3)])
def test_an_accelerometer_on_its_mounting_is_a_filter_of_second_order(frequency, share):
    """The plate's acceleration at 160 times the rate, through a filter that knows no rig."""
    interval, samples, more = 1 / 1600, 40, 160
    own = {"mounting": share, "f_mounting": frequency, "zeta_mounting": 0.1}
    plain, mounted = (
        rig_of(NOMINAL | own, names, walkers=True)
        for names in (BASE, (*BASE, "accelerometer-resonance"))
    )

    @eqx.filter_jit
    def ring(rig, length, count):
        ones = jnp.ones((1, 1))
        return release.ring(rig, 6e3 * ones, 0.0 * ones, length, count)[:, 0, 0]

    read = np.asarray(ring(mounted, interval, samples))
    fine = np.asarray(ring(plain, interval / more, samples * more))
    time = 1.0 / (2.0 * np.pi * frequency)
    swing = ([1.0], [time**2, 0.2 * time, 1.0])
    top, bottom, _ = cont2discrete(swing, interval / more, method="foh")
    through = lfilter(np.ravel(top), bottom, fine)[::more]
    change = share * (through - fine[::more])
    error = np.abs(read - fine[::more] - change).max()
    assert error < 0.02 * np.abs(change).max()
    assert np.abs(change).max() > 0.2 * np.abs(fine).max()
