"""Effects of sensors and of a shut valve, against filters and formulas outside the simulation."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, rig_of
from scipy.signal import cont2discrete, lfilter
from test_catalogue import RECORDS, SIGNATURES, SPRINGS, base, simulated

from rigid.effects import CATALOGUE
from rigid.physics import release

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
