"""Time stamps that lag, against records sampled at the instants that were meant."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, drive, in_full, march_still, rig_of
from scipy.stats import norm

from rigid.effects import CATALOGUE
from rigid.likelihood.priors import Normal
from rigid.localfit.candidates import candidates, priors_of
from rigid.physics import slow
from rigid.physics.drive import side_by_side
from rigid.physics.rig import Rig

PSI = 6894.757
FINE = 16
"""Of these parts of a sampling interval a delay is a whole number."""
RECORDS = {
    "frame": (drive(90, (0.053, 0.503), (0, 1, 0)), NOMINAL["k_frame"], (0.0, 0.1)),
    "free-run": (drive(90, (0.053, 0.303, 0.6), (0, 1, 0, 2)), 0.0, (0.0, 0.2, -0.2)),
}


def readings(
    march, record, kind: str, delay: float | None, ratio: float = 0.0
) -> dict[str, np.ndarray]:
    names = BASE if delay is None else (*BASE, "clock-offset")
    more = {} if delay is None else {"pressure_delay": delay, "load_delay_ratio": ratio}
    rig = rig_of(NOMINAL | more, names, walkers=True)
    _, contact, fractions = RECORDS[kind]
    levels = jnp.asarray(fractions)[:, None, None]
    out = eqx.filter_jit(march)(rig, jnp.asarray([contact]), levels, side_by_side((record,)))
    return {name: np.asarray(series)[: record.samples, 0, 0] for name, series in out.items()}


def pressure(march, record, kind: str, delay: float | None) -> np.ndarray:
    return readings(march, record, kind, delay)["pressure"]


def test_the_load_lags_by_its_share_and_the_stroke_is_on_time():
    record = RECORDS["frame"][0]
    on_time = readings(march_still, record, "frame", None)
    late = readings(march_still, record, "frame", 4 * record.interval, ratio=0.5)
    for name, samples in (("pressure", 4), ("load", 2), ("stroke", 0)):
        meant = on_time[name][4 - samples : record.samples - samples]
        np.testing.assert_allclose(late[name][4:], meant, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", RECORDS)
@pytest.mark.parametrize("march", [slow.march, march_still])
def test_a_delay_shorter_than_a_sample_moves_no_jump(march, kind: str):
    """Spread over its sample, a jump of 4 bar by a sixteenth of it would be off by 3 psi."""
    record = RECORDS[kind][0]
    samples = (record.size - 1) * FINE + 1
    fine = dataclasses.replace(
        record, interval=record.interval / FINE, samples=samples, size=samples
    )
    exact = pressure(slow.march, fine, kind, None)
    place = FINE * np.arange(1, record.samples - 1)
    assert np.ptp(exact) > 20 * PSI
    for parts in (-1, 1, 4 * FINE):
        got = pressure(march, record, kind, parts * record.interval / FINE)
        meant = exact[np.clip(place - parts, 0, None)]
        assert np.abs(got[1:-1] - meant).max() < 0.5 * PSI


@pytest.mark.slow
@pytest.mark.parametrize("march", [slow.march, march_still])
def test_a_quick_gauge_may_have_late_time_stamps_as_well(march):
    """It settles within a sample after the valve has moved, where one cubic was 0.8 steps off."""
    record, contact, fractions = RECORDS["free-run"]
    own = {"tau_gauge": 1.5e-3, "pressure_delay": 3e-3, "load_delay_ratio": 0.0}
    rig = rig_of(NOMINAL | own, (*BASE, "clock-offset", "pressure-gauge-lag"), walkers=True)
    levels = jnp.asarray(fractions)[:, None, None]
    out = eqx.filter_jit(march)(rig, jnp.asarray([contact]), levels, side_by_side((record,)))
    solved = in_full(rig, contact, fractions, record)
    error = np.asarray(out["pressure"])[:, 0, 0] - solved["pressure"]
    assert np.abs(error).max() < 0.5 * PSI


@pytest.mark.slow
@pytest.mark.parametrize("march", [slow.march, march_still])
def test_early_readings_go_on_after_the_last_sample(march):
    """On the way to the tank, where the pressure falls, in the reference as in the steps."""
    record = drive(90, (0.1, 0.5), (0, 1, 2))
    early = NOMINAL | {"pressure_delay": -4e-3, "load_delay_ratio": 0.0}
    rig = rig_of(early, (*BASE, "clock-offset"), walkers=True)
    levels = jnp.asarray([0.0, 0.3, -0.2])[:, None, None]
    frame = jnp.asarray([NOMINAL["k_frame"]])
    grid = side_by_side((dataclasses.replace(record, size=96),))
    out = np.asarray(eqx.filter_jit(march)(rig, frame, levels, grid)["pressure"])[:90, 0, 0]
    solved = in_full(rig, frame[0], (0.0, 0.3, -0.2), record)["pressure"]
    assert np.abs(out - solved).max() < 0.5 * PSI
    assert solved[88] - solved[89] > PSI


@pytest.mark.slow
def test_what_no_slow_record_reads_may_lag_as_well(monkeypatch):
    monkeypatch.setattr(Rig, "delays", lambda _: {"acceleration": jnp.asarray([1e-3])})
    got = pressure(slow.march, RECORDS["frame"][0], "frame", None)
    monkeypatch.undo()
    np.testing.assert_allclose(got, pressure(slow.march, RECORDS["frame"][0], "frame", None))


def test_late_and_early_are_candidates_of_their_own():
    """Where the valve switches at a sample, what a delay leaves is not minus what a lead leaves."""
    clock = CATALOGUE["clock-offset"]
    late, early = candidates((clock,), 1)
    law = priors_of(clock, {})["pressure_delay"][1]
    z = np.linspace(-3.0, 3.0, 25)
    for one, sign in ((late, 1.0), (early, -1.0)):
        assert np.sign(one.shape["pressure_delay"]) == sign
        assert abs(one.shape["pressure_delay"]) < 1e-8
        # each half of the prior, once: P(side < x) = P(|d| < x)
        expected = law.from_standard(norm.ppf(0.5 + 0.5 * norm.cdf(z)))
        np.testing.assert_allclose(sign * one.prior.from_standard(z), expected, rtol=1e-9)
    [shifted] = candidates((clock,), 1, {"pressure_delay": Normal(-0.01, 0.002)})
    assert shifted.shape["pressure_delay"] < 0.0
    assert isinstance(shifted.prior, Normal)
