"""The strength of hidden causes: a projection, checked against what it must be."""

from dataclasses import replace

import numpy as np
import pytest
from short import FRAME, FREE, short_truth

from rigid.generator.hidden import hide
from rigid.generator.refit import Key, constants, moved, noiseless
from rigid.generator.simulate import simulate
from rigid.generator.stacked import side_by_side
from rigid.generator.strength import Ground, at_strength, ground


@pytest.fixture(scope="module")
def on() -> Ground:
    return ground(short_truth())


def drawn(name: str, seed: int = 5):
    return hide(name, np.random.default_rng(seed), (FRAME, FREE))


def test_readings_are_those_of_the_sensors_without_noise(on):
    assert set(on.base) == {
        Key(run, "A", channel)
        for run in ("frame-1", "free-run-1")
        for channel in ("load", "stroke", "pressure")
    } | {Key("release-1", "A", "acceleration")}
    sensor = on.truth.sensors["load,A"]
    assert on.base[Key("frame-1", "A", "load")][0] == sensor.zero
    one = drawn("load-cell-drift")
    more = noiseless(on.truth, (one,))[Key("free-run-1", "A", "load")]
    drift = one.sign * one.amplitude * one.warming * (1 - np.exp(-1.5 / one.warming))
    change = more[-1] - on.base[Key("free-run-1", "A", "load")][-1]
    assert change == pytest.approx(sensor.gain * drift, rel=1e-6)


def test_constants_move_by_their_priors():
    truth = short_truth()
    by = {one.name: one for one in constants(truth) if one.owner in {"", "frame-1,A", "load,A"}}
    new = moved(truth, {by["k_LC"]: 1.0, by["kappa"]: -1.0, by["gain"]: 2.0, by["zero"]: 1.0})
    assert new.rig.k_LC / truth.rig.k_LC == pytest.approx(2.0)
    assert new.runs[0].kappa / truth.runs[0].kappa == pytest.approx(1 / 3)
    assert new.runs[1] == truth.runs[1]
    changed = new.sensors["load,A"]
    assert changed.gain - truth.sensors["load,A"].gain == pytest.approx(2e-3)
    assert changed.zero - truth.sensors["load,A"].zero == pytest.approx(100.0)
    assert len(constants(truth)) == 12 + 2 + 1 + 2 + 2 * 4


@pytest.mark.parametrize("run", [FRAME, FREE], ids=["frame", "free-run"])
def test_rigs_side_by_side_move_as_they_do_alone(run):
    truth = short_truth()
    stiff = replace(truth, rig=replace(truth.rig, k_LC=1.1 * truth.rig.k_LC))
    open_wide = replace(run, kappa=1.05 * run.kappa)
    read = side_by_side([truth, stiff, truth], [run, run, open_wide])
    alone = [simulate(t, r).values for t, r in ((truth, run), (stiff, run), (truth, open_wide))]
    for together, single in zip(read, alone, strict=True):
        for channel in ("load", "stroke", "pressure"):
            noise = truth.sensors[f"{channel},A"].noise
            # both err by less than a thousandth of the noise
            np.testing.assert_allclose(together[channel], single[channel], atol=2e-3 * noise)
    assert np.abs(read[2]["stroke"] - read[0]["stroke"]).max() > 1e-5


def test_slopes_are_those_of_larger_steps(on):
    """Half a prior sd of what the readings follow nearly in proportion."""
    listed = constants(on.truth)
    slopes = on.shape @ on.price
    for name in ("k_oil", "k_frame", "gain", "preload"):
        at = next(i for i, one in enumerate(listed) if one.name == name)
        far = on._made_by(np.where(np.arange(len(listed)) == at, 0.5, 0.0))
        near = 0.5 * slopes[:, at]
        # curvature: half a prior sd is 2.5 % at most, which the trace may differ by
        assert np.linalg.norm(far - near) < 0.03 * np.linalg.norm(near), name


def test_strength_is_the_penalised_distance(on):
    """The same by another formula: t (1 + J J^T)^-1 t, on every 20th sample."""
    trace = on.trace(drawn("rough-bore"))
    slopes = (on.shape @ on.price)[::20]
    thin = np.linalg.qr(np.concatenate([slopes, np.eye(slopes.shape[1])]))
    part = replace(on, shape=thin[0][: len(slopes)], price=thin[1])
    few = trace[::20]
    expected = few @ np.linalg.solve(np.eye(len(few)) + slopes @ slopes.T, few)
    # 1 + J J^T has entries of the square of the largest slope, which costs its digits
    assert part.strength(few) ** 2 == pytest.approx(expected, rel=1e-4)


def test_what_a_constant_does_is_absorbed(on):
    listed = constants(on.truth)
    slopes = on.shape @ on.price
    for name in ("k_LC", "kappa", "mu_inf"):
        at = next(i for i, one in enumerate(listed) if one.name == name)
        trace = 0.01 * slopes[:, at]
        # absorbed whole, at the price of the prior: at most 0.01 sd
        assert on.strength(trace) <= 0.01
        assert np.linalg.norm(trace) > 1.0


def test_strength_grows_with_amplitude_and_falls_with_noise(on):
    one = drawn("load-cell-drift")
    strong, weak = (on.strength(on.trace(one.of(a * one.amplitude))) for a in (2.0, 1.0))
    assert strong == pytest.approx(2.0 * weak, rel=1e-6)
    loud = {
        name: replace(s, noise=2.0 * s.noise, step=2.0 * s.step)
        for name, s in on.truth.sensors.items()
    }
    faint = ground(replace(on.truth, sensors=loud))
    trace = faint.trace(one)
    np.testing.assert_allclose(trace, on.trace(one) / 2.0, rtol=1e-6, atol=1e-9)
    # louder noise leaves the priors more of the say, so that more than half of it remains
    assert 0.5 < faint.strength(trace) / weak < 1.0


def test_a_refit_in_earnest_confirms_the_linear_one(on):
    trace = on.trace(drawn("hose-pressure-drop"))
    strength, z, made, _ = on.refitted(trace)
    # between them stands the curvature of what the constants do, which for less than one prior
    # sd of any is a few per cent of their own part
    assert strength == pytest.approx(on.strength(trace), rel=0.1)
    assert strength < 0.9 * np.linalg.norm(trace)
    assert np.abs(z).max() < 2.0
    left = trace - on._made_by(z)
    np.testing.assert_allclose(on._made_by(z), made, atol=1e-9)
    assert np.sqrt(left @ left + z @ z) == pytest.approx(strength)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["coulomb-friction", "clock-offset", "seating-slack"])
@pytest.mark.parametrize("wanted", [3.0, 12.0])
def test_an_amplitude_is_found_for_a_strength(on, name, wanted):
    one, strength = at_strength(on, drawn(name), wanted)
    assert strength == pytest.approx(wanted, rel=0.05)
    again = on.refitted(on.trace(one)).strength
    linear = on.strength(on.trace(one))
    assert min(abs(again - strength), abs(linear - strength)) < 0.02 * wanted


def test_a_strength_out_of_reach_is_refused(on):
    slow_stage = drawn("pump-stage-switch")
    nowhere = replace(slow_stage, share=1e-12)
    with pytest.raises(ValueError, match="pump-stage-switch does not reach"):
        at_strength(on, nowhere, 8.0)


def test_cosines_find_lookalikes(on):
    names = ["coulomb-friction", "stribeck-friction", "load-cell-drift"]
    traces = [on.trace(drawn(name)) for name in names]
    cosines = on.cosines(traces)
    np.testing.assert_allclose(np.diag(cosines), 1.0)
    np.testing.assert_allclose(cosines, cosines.T)
    assert cosines[0, 1] > 0.8  # issue 6 found 1.00 for small ones in longer records
    assert abs(cosines[0, 2]) < 0.5
