"""Each hidden cause against what its equation says, and that it is absent at amplitude 0."""

from dataclasses import replace
from math import exp, pi
from pathlib import Path

import numpy as np
import pytest
from short import FRAME, FREE, RELEASE, SPEED, short_truth

from rigid.generator.constants import AREA, P_MAX
from rigid.generator.core import Motion, Run, Seen, Switch
from rigid.generator.draw import Truth
from rigid.generator.hidden import CATALOGUED, HIDDEN, OUTSIDE, Hidden, hide
from rigid.generator.hidden.dry import bending_rate
from rigid.generator.hidden.flow import FAST_LESS_SLOW
from rigid.generator.hidden.sensing import PER_NEWTON
from rigid.generator.pieces import pump_flow
from rigid.generator.plant import trajectory
from rigid.generator.simulate import plant_of, sampling_times, simulate

RUNS = (FRAME, FREE, RELEASE)
HOLD = slice(95, 108)  # of the frame: shut, the ringing mostly gone
RINGING = 3e-3  # relative, what a mean over 70 periods leaves of a tenth of the load
STEADY = slice(90, 118)  # of the free run: five times its slow branch's memory


@pytest.fixture(scope="module")
def truth() -> Truth:
    return short_truth()


@pytest.fixture(scope="module")
def plain(truth) -> dict[str, dict]:
    """Readings of every run in which nothing is hidden."""
    return {run.name: simulate(truth, run).values for run in RUNS}


def cause(name: str, amplitude: float | None = None, **numbers) -> Hidden:
    drawn = replace(hide(name, np.random.default_rng(5), RUNS), **numbers)
    return drawn if amplitude is None else drawn.of(amplitude)


def pair(truth: Truth, run: Run, hidden: Hidden) -> tuple[dict, dict]:
    return simulate(truth, run).values, simulate(truth, run, (hidden,)).values


def states(truth: Truth, run: Run, hidden: Hidden, times: np.ndarray) -> np.ndarray:
    plant = plant_of(truth, run, (hidden,))
    return trajectory(plant, plant.balanced(), times).states


def held(truth: Truth, hidden: Hidden) -> tuple[float, float]:
    """Mean places of cylinder and plunger in the frame's hold, over the ringing at 240 Hz."""
    motion = states(truth, FRAME, hidden, np.arange(2201) / 2000)
    return motion[0][1600:].mean(), motion[2][1600:].mean()


def test_every_effect_that_can_be_missing_can_be_hidden():
    assert len(CATALOGUED) == 31
    assert len(OUTSIDE) >= 5
    assert not set(CATALOGUED) & set(OUTSIDE)


@pytest.mark.parametrize("name", HIDDEN)
def test_at_amplitude_zero_nothing_changes(truth, plain, name):
    for run in RUNS:
        same = simulate(truth, run, (cause(name, 0.0),)).values
        for channel, values in plain[run.name].items():
            np.testing.assert_array_equal(same[channel], values)


@pytest.mark.parametrize("name", sorted(set(HIDDEN) - {"pump-stage-switch"}))
def test_it_comes_in_continuously_and_acts_where_it_says(truth, plain, name):
    one = cause(name)
    felt = 0.0
    for run in RUNS:
        whole = simulate(truth, run, (one,)).values
        tenth = simulate(truth, run, (one.of(0.1 * one.amplitude),)).values
        for channel, values in plain[run.name].items():
            noise = truth.sensors[f"{channel},A"].noise
            full = np.abs(whole[channel] - values).max() / noise
            part = np.abs(tenth[channel] - values).max() / noise
            felt = max(felt, full)
            if not one.acts(run):
                assert full == 0.0
            # Proportion would be 0.1; a bristle ten times as soft, or a clearance, is not in
            # proportion. A thousandth of the noise is left to the solver.
            assert part < 0.3 * full + 1e-3, (run.name, channel)
    assert felt > 0.02


@pytest.mark.parametrize("name", HIDDEN)
def test_numbers_are_drawn_and_told(name):
    draws = [hide(name, np.random.default_rng(seed), RUNS) for seed in (1, 1, 2, 3, 4)]
    assert draws[0] == draws[1]
    if len(draws[0].parameters()) > 1:
        assert len(set(draws)) > 1
    assert draws[0].parameters()["amplitude"] == type(draws[0]).typical


def test_an_unknown_name_is_refused():
    with pytest.raises(ValueError, match="known are coulomb-friction"):
        hide("friction", np.random.default_rng(1), RUNS)


# 1e-3 of the change stands for what is not settled after five memory times: exp(-5) of a branch
# that carries a part of it.
@pytest.mark.parametrize("name", ["coulomb-friction", "return-spring"])
def test_a_force_of_its_own_raises_the_pressure_of_a_free_run(truth, name):
    one = cause(name, 400.0)
    plain, more = pair(truth, FREE, one)
    force = AREA * (more["pressure"] - plain["pressure"])[STEADY]
    expected = np.full(force.size, 400.0)
    if name == "return-spring":
        stroke = more["stroke"][STEADY]
        expected = 400.0 * (stroke / (stroke + one.toe) + (1 - stroke / 0.5) ** -1.2 - 1)
    np.testing.assert_allclose(force, expected, rtol=1e-2)


def test_coulomb_friction_holds_and_turns_over(truth):
    plain, more = pair(truth, FRAME, cause("coulomb-friction", 400.0))
    rub = AREA * more["pressure"] - more["load"] - (AREA * plain["pressure"] - plain["load"])
    assert rub[HOLD].mean() > 300.0  # it holds what it did, less what the springs take back
    # 10 %: the other friction differs a little as well, since the speeds do
    assert rub[60] == pytest.approx(400.0, rel=0.1)
    assert rub[135] == pytest.approx(-400.0, rel=0.1)


def test_bristles_slide_at_their_limits():
    for slip in (1e-3, -1e-3):
        sign = np.sign(slip)
        assert bending_rate(sign * 2e-5, slip, 2e-5) == pytest.approx(0.0, abs=1e-12)
        assert bending_rate(sign * 1e-5, slip, 2e-5) == slip  # elastic
        assert bending_rate(-sign * 2e-5, slip, 2e-5) == slip  # on the way back
    motion = Motion(0.0, 0.0, 0.0, 2e-3, 300e5)
    stribeck = cause("stribeck-friction", 400.0, excess=0.5, speed=2e-3, bending=2e-5)
    assert stribeck.act(0.0, motion, [2e-5 * 1.25]).rates[0] == pytest.approx(0.0, abs=1e-12)
    assert stribeck.act(0.0, motion, [2e-5 * 1.25]).on_plunger == pytest.approx(-500.0)
    lugre = cause("lugre-friction", 400.0, excess=0.5, speed=2e-3, bending=2e-4, damping=20.0)
    limit = 1 + 0.5 * exp(-1)
    assert lugre.act(0.0, motion, [2e-4 * limit]).on_plunger == pytest.approx(-400.0 * limit)
    damped = lugre.act(0.0, motion, [0.0]).on_plunger  # elastic: the bristle moves as the plunger
    assert damped == pytest.approx(-400.0 * 20.0 * exp(-1) * 2e-3)
    seal = cause("pressure-dependent-friction", 1e-5, fading=2e8, bending=2e-5)
    assert seal.act(0.0, motion, [2e-5]).on_plunger == pytest.approx(-1e-5 * 300e5 / 1.15)
    assert seal.act(0.0, motion._replace(p=-1e5), [2e-5]).on_plunger == 0.0


@pytest.mark.parametrize("frequency", [0.1, 2.0, 50.0])
def test_memory_is_its_ladder_of_branches(frequency):
    one = cause("frequency-dependent-friction", 3e4, slowest=0.12)
    rate, times = 2j * pi * frequency, [0.12, 0.03, 0.0075]
    state = [1.0, rate, *(1 / (1 + rate * tau) for tau in times)]
    parts = [
        one.act(0.0, Motion(0.0, 0.0, stroke, speed, 0.0), own).on_plunger
        for stroke, speed, *own in (np.real(state).tolist(), np.imag(state).tolist())
    ]
    expected = -sum(3e4 / (1 + rate * tau) for tau in times) * rate
    assert complex(*parts) == pytest.approx(expected)


def test_a_constant_force_is_there_before_the_record_begins(truth):
    waiting = replace(FREE, valve=(Switch(1.5, "shut"),))
    read = simulate(truth, waiting, (cause("constant-force", 200.0, sign=-1),)).values
    np.testing.assert_allclose(read["load"], 200.0, rtol=1e-6)
    np.testing.assert_allclose(read["pressure"], 200.0 / AREA, rtol=1e-6)
    np.testing.assert_allclose(read["stroke"], 0.0, atol=1e-10)


def test_viscosity_of_one_direction_acts_on_the_way_back(truth):
    one = cause("direction-dependent-viscosity", 1e5, sign=1)
    back, out = (one.act(0.0, Motion(0, 0, 0, v, 0), []).on_plunger for v in (-5e-3, 5e-3))
    assert back == pytest.approx(500.0, rel=1e-2)
    assert abs(out) < 0.01 * back
    plain, more = pair(truth, FRAME, one)
    change = np.abs(more["pressure"] - plain["pressure"])
    assert change[110:140].max() > 5 * change[:70].max()


def test_effective_area_is_load_over_pressure(truth):
    nominal, read = (
        one["load"][HOLD] / one["pressure"][HOLD]
        for one in pair(truth, FRAME, cause("effective-area", 0.02, sign=-1))
    )
    # the friction that both still hold is a part in a hundred of the load, its change a hundredth
    assert np.mean(read) / np.mean(nominal) == pytest.approx(0.98, abs=1e-3)
    plain, less = pair(truth, FREE, cause("effective-area", 0.02, sign=-1))
    ratio = np.diff(less["stroke"][[90, 118]]) / np.diff(plain["stroke"][[90, 118]])
    assert ratio == pytest.approx(1 / 0.98, rel=1e-4)


def test_leakage_empties_a_hold(truth):
    longer = replace(FRAME, duration=2.7, valve=(Switch(0.7, "open"), Switch(2.7, "shut")))
    one = cause("piston-leakage", 2e-14)
    _, less = pair(truth, longer, one)
    rig = truth.rig
    p, stroke = less["pressure"], less["stroke"]
    springs = 1 / (1 / rig.k_LC + 1 / rig.k_frame)
    give = AREA**2 / springs + AREA * (rig.L_0 + stroke[200]) / rig.k_oil
    fall = -np.polyfit(sampling_times(longer)[170:260], p[170:260], 1)[0]
    expected = 2e-14 * p[215] * (1 + p[215] / 1e8) / give
    assert fall == pytest.approx(expected, rel=0.03)  # the friction's memory still creeps a little


def test_air_gives_way_by_what_a_polytropic_gas_does(truth):
    (one,) = cause("entrained-air", 0.01, exponent=1.2).pieces(truth.rig, FRAME)
    pressures = np.linspace(0.0, 50e5, 20_001)
    give = [one.act(0.0, Motion(0, 0, 0, 0, p), []).compliance for p in pressures.tolist()]
    squeezed = np.trapezoid(give, pressures)
    volume = AREA * truth.rig.L_0
    expected = 0.01 * volume * (1 - (1.01325 / 51.01325) ** (1 / 1.2))
    assert squeezed == pytest.approx(expected, rel=1e-4)
    assert np.isfinite(one.act(0.0, Motion(0, 0, 0, 0, -3e5), []).compliance)


def test_the_hose_takes_what_its_flow_asks_for(truth):
    plain, more = pair(truth, FRAME, cause("hose-pressure-drop", 2e9))
    np.testing.assert_array_equal(more["load"], plain["load"])
    q = FRAME.kappa * pump_flow(0.0)
    drop = more["pressure"] - plain["pressure"]
    np.testing.assert_allclose(drop[5:69], 2e9 * q * (1 + (q / (10e-3 / 60)) ** 0.75), rtol=1e-3)
    np.testing.assert_array_equal(drop[71:109], 0.0)
    assert drop[120] < 0.0


def test_the_slow_stage_sets_in_at_its_pressure(truth):
    one = cause("pump-stage-switch", np.log(P_MAX / 150e5), share=1.0)
    (slow,) = one.pieces(truth.rig, FRAME)
    at = [slow.during(0.0, 0.7).act(0.1, Motion(0, 0, 0, 0, p), []).flow for p in (50e5, 300e5)]
    np.testing.assert_allclose(at, [0.0, -FRAME.kappa * FAST_LESS_SLOW], atol=1e-12)
    assert slow.during(1.1, 1.4).act(1.2, Motion(0, 0, 0, 0, 300e5), []).flow == 0.0
    assert one.parameters()["pressure"] == pytest.approx(150e5)
    plain, less = pair(truth, FRAME, one)
    first = int(np.argmax(plain["pressure"] > 100e5))
    np.testing.assert_allclose(less["load"][:first], plain["load"][:first], rtol=1e-3)
    assert less["load"][68] < 0.75 * plain["load"][68]


def test_ripple_has_its_frequency_and_a_phase_a_record(truth):
    one = cause("pump-ripple", 0.02, frequency=5.0)
    pieces = [one.pieces(truth.rig, replace(FREE, name=name))[0] for name in ("one", "two")]
    times = np.linspace(0.0, 0.2, 401)[:-1]
    beats = [
        [p.during(0.0, 1.2).act(t, Motion(0, 0, 0, 0, 0), []).flow for t in times.tolist()]
        for p in pieces
    ]
    lines = np.abs(np.fft.rfft(beats, axis=1))[:, :4] / 200 / (FREE.kappa * pump_flow(0.0))
    np.testing.assert_allclose(lines, [[0.0, 0.02, 0.006, 0.0]] * 2, atol=1e-9)
    assert np.abs(np.subtract(*beats)).max() > 1e-3 * np.abs(beats).max()
    assert pieces[0].during(1.2, 1.5).act(1.3, Motion(0, 0, 0, 0, 0), []).flow == 0.0


def test_a_valve_event_passes_more_for_a_while_in_one_record(truth):
    one = cause("valve-event", 0.3, sign=1, record="free-run-1", cylinder="A", start=0.4, end=0.7)
    plain, more = pair(truth, FREE, one)
    gained = more["stroke"] - plain["stroke"]
    np.testing.assert_array_equal(gained[:40], 0.0)
    assert gained[118] == pytest.approx((exp(0.3) - 1) * 0.3 * SPEED, rel=0.02)
    assert not one.within(truth.rig, FRAME)


def test_a_stiffening_cell_reads_the_force_in_it(truth):
    one = cause("load-cell-stiffening", 0.1)
    read = simulate(truth, FRAME, (one,)).values
    x_hc = states(truth, FRAME, one, sampling_times(FRAME))[0]

    def force(x_hc):
        return -truth.rig.k_LC * x_hc * (1 + 0.1 * (truth.rig.k_LC * x_hc / 200e3) ** 2)

    np.testing.assert_allclose(read["load"], force(x_hc), rtol=1e-9, atol=1e-6)
    x_hc, x_pl = held(truth, one)
    assert force(x_hc) == pytest.approx(truth.rig.k_frame * x_pl, rel=RINGING)


def test_a_root_without_a_strap_keeps_the_momentum(truth):
    one = cause("free-root-plate", 1 / 150.0, frequency=1e-4)
    plant = plant_of(truth, RELEASE, (one,))
    motion = trajectory(plant, plant.balanced(6000.0), np.linspace(0.0, 0.05, 101)).states
    rig = plant.rig
    momenta = rig.mass_cylinder * motion[1], rig.mass_plunger * motion[3], 150.0 * motion[-1]
    # the hook's 6000 N are gone, and nothing else pulls from outside
    assert np.abs(sum(momenta)).max() < 1e-4 * np.abs(momenta).max()


def test_slack_lets_the_frame_stand_back(truth):
    one = cause("seating-slack", 3e-4)
    x_hc, x_pl = held(truth, one)
    load = -truth.rig.k_LC * x_hc
    missing = 3e-4 * (1 - exp(-x_pl / 3e-4))
    assert truth.rig.k_frame * (x_pl - missing) == pytest.approx(load, rel=RINGING)


def test_a_late_stroke_is_short_by_its_time(truth):
    plain, late = pair(truth, FREE, cause("stroke-sensor-lag", 0.03))
    short = (plain["stroke"] - late["stroke"])[STEADY]
    speed = np.gradient(plain["stroke"], 0.01)[STEADY]
    np.testing.assert_allclose(short, 0.03 * speed, rtol=1e-3)
    np.testing.assert_allclose(late["load"], plain["load"], rtol=1e-6, atol=1e-3)


def test_a_drift_is_that_of_a_cell_that_warms_up(truth):
    one = cause("load-cell-drift", 20.0, sign=-1, warming=10.0)
    plain, moved = pair(truth, FREE, one)
    expected = -200.0 * (1 - np.exp(-sampling_times(FREE) / 10.0))
    np.testing.assert_allclose(moved["load"] - plain["load"], expected, atol=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_clock_offset_moves_the_pressure_alone(truth, sign):
    plain, moved = pair(truth, FREE, cause("clock-offset", 0.02, sign=sign))
    kept = slice(2, -2)
    shifted = np.roll(plain["pressure"], 2 * sign)[kept]
    np.testing.assert_allclose(moved["pressure"][kept], shifted, rtol=1e-6, atol=1.0)
    np.testing.assert_allclose(moved["stroke"], plain["stroke"], rtol=1e-7, atol=1e-12)


def test_outside_forms_do_what_they_say(truth):
    rough = cause("rough-bore", 50.0, period=4e-3)
    assert rough.act(0.0, Motion(0, 0, 1e-3, 0, 0), []).on_plunger == pytest.approx(-50.0)
    drag = cause("guide-drag", 1e4)
    assert drag.act(0.0, Motion(0, -2e-3, 0, 0, 0), []).on_cylinder == pytest.approx(20.0)
    (oil,) = cause("oil-stiffening", 0.2).pieces(truth.rig, FRAME)
    soft = AREA * truth.rig.L_0 / truth.rig.k_oil
    give = soft + oil.act(0.0, Motion(0, 0, 0, 0, 300e5), []).compliance
    assert give == pytest.approx(soft / 1.2)
    (slip,) = cause("pump-slip", 0.05).pieces(truth.rig, FRAME)
    lost = slip.during(0.0, 0.7).act(0.1, Motion(0, 0, 0, 0, 300e5), []).flow
    assert lost == pytest.approx(-0.05 * FRAME.kappa * pump_flow(0.0))


def test_outside_readings_do_what_they_say(truth):
    jump = cause("gauge-jump", 1e5, sign=1, record="free-run-1", cylinder="A", instant=0.5)
    plain, read = pair(truth, FREE, jump)
    gone = (read["pressure"] - plain["pressure"]).tolist()
    assert gone == pytest.approx([0.0] * 50 + [1e5] * 101, abs=1e-6)
    plain, read = pair(truth, FREE, cause("stroke-wave", 3e-5, period=3e-3))
    wave = 3e-5 * np.sin(2 * np.pi * plain["stroke"] / 3e-3)
    np.testing.assert_allclose(read["stroke"] - plain["stroke"], wave, atol=1e-11)


def late(series: np.ndarray, times: np.ndarray, lasting: float) -> np.ndarray:
    """A series (n,) through a low pass, by the midpoint rule: at 100 Hz good to a part in 1e3."""
    lagged = np.zeros(times.size)
    for i, step in enumerate(np.diff(times)):
        middle = (series[i] + series[i + 1]) / 2
        lagged[i + 1] = lagged[i] + step * (middle - lagged[i]) / (lasting + step / 2)
    return lagged


def test_a_creeping_cell_reads_a_share_late(truth):
    plain, read = pair(truth, FRAME, cause("load-cell-creep", 0.01, lasting=0.5))
    times, crept = sampling_times(FRAME), read["load"] - plain["load"]
    lagged = 0.7 * late(plain["load"], times, 0.5) + 0.3 * late(plain["load"], times, 0.5 / 6.0)
    np.testing.assert_allclose(crept, 0.01 * lagged, atol=0.01 * 0.01 * plain["load"].max())


def test_a_cell_with_hysteresis_reads_its_loop_once_the_load_has_passed_every_stop(truth):
    one = cause("load-cell-hysteresis", 100.0, sign=-1, width=300.0)
    plain, read = pair(truth, FRAME, one)
    load, error = plain["load"], read["load"] - plain["load"]
    up, down = int(np.argmax(load > 700.0)), int(np.argmax(load)) + 1
    # a stop moves within +-r, the widest within +-600 N
    down += int(np.argmax(load[down:] < load.max() - 1300.0))
    assert load[up:].min() > 700.0
    np.testing.assert_allclose(error[up], -100.0, rtol=1e-9)
    np.testing.assert_allclose(error[down], 100.0, rtol=1e-9)
    for channel in ("stroke", "pressure"):
        np.testing.assert_array_equal(read[channel], plain[channel])


def test_a_loop_opens_by_its_stops():
    """Loads by hand: a rise to 1 kN, back by 1 kN, and again as far as the narrower stops turn."""
    one = cause("load-cell-hysteresis", 100.0, sign=1, width=400.0)
    load = np.array([0.0, 1000.0, 0.0, 400.0, 400.0])
    held = [
        [0.0, 0.0, 0.0, 0.0],
        [100.0, 200.0, 400.0, 800.0],
        [-100.0, -200.0, -400.0, -200.0],
        [100.0, 200.0, 0.0, 200.0],
        [100.0, 200.0, 0.0, 200.0],
    ]
    expected = 100.0 * np.mean(np.array(held) / [100.0, 200.0, 400.0, 800.0], axis=1)
    still = np.zeros(5)
    seen = Seen(np.arange(5.0), Motion(*[still] * 5), np.zeros((0, 5)), still)
    got = one.read(seen, {"load": load})["load"] - load
    np.testing.assert_allclose(got, expected, rtol=1e-12)


def test_a_late_gauge_is_two_low_passes(truth):
    plain, read = pair(truth, FRAME, cause("pressure-gauge-lag", 0.2))
    times = sampling_times(FRAME)
    lagged = late(late(plain["pressure"], times, 0.1), times, 0.1)
    np.testing.assert_allclose(read["pressure"], lagged, atol=0.01 * plain["pressure"].max())
    np.testing.assert_allclose(read["load"], plain["load"], rtol=1e-6, atol=1e-3)


def test_sensors_warm_up_together(truth):
    one = cause("temperature-drift", 50.0, sign=-1, ratio=200.0, lasting=3.0)
    plain, read = pair(truth, FREE, one)
    times = sampling_times(FREE)
    moved = -50.0 * times / (times + 3.0)
    np.testing.assert_allclose(read["load"] - plain["load"], moved, atol=1e-6)
    np.testing.assert_allclose(read["pressure"] - plain["pressure"], 200.0 * moved, atol=1e-3)


def test_a_shut_valve_leaks_where_nothing_comes_in(truth):
    one = cause("shut-valve-leakage", 1e-14)
    (leak,) = one.pieces(truth.rig, FRAME)
    passing = [leak.during(*when).act(0.0, Motion(0, 0, 0, 0, 300e5), []).loss
               for when in ((0.0, 0.7), (0.7, 1.1))]  # fmt: skip
    assert passing == pytest.approx([0.0, 1e-14 * 300e5 / 2.0])
    plain, less = pair(truth, FRAME, one)
    np.testing.assert_allclose(less["pressure"][:69], plain["pressure"][:69], rtol=1e-9, atol=1.0)
    assert less["pressure"][108] < plain["pressure"][108]


def test_a_mounting_swings_at_its_frequency(truth):
    one = cause("accelerometer-resonance", 1.0, frequency=300.0, damping=0.02)
    for turn, states in ((300.0, slice(0, 2)), (600.0, slice(2, 4))):
        own = [0.0] * 4
        own[states] = [1.0, 0.0]
        rates = one.act(0.0, Motion(0, 0, 0, 0, 0), own).rates
        assert rates[states][1] == pytest.approx(-((2.0 * pi * turn) ** 2))
    plain, read = pair(truth, RELEASE, one)
    change = (read["acceleration"] - plain["acceleration"])[-64:]
    assert np.abs(change).max() > 0.05 * np.abs(plain["acceleration"]).max()


@pytest.mark.parametrize(("run", "frequency"), [(FREE, 12.5), (RELEASE, 25.0)])
def test_sensors_pick_up_the_mains_at_angles_of_their_own(truth, run, frequency):
    plain, read = pair(truth, run, cause("mains-pickup", 30.0, frequency=frequency))
    times = sampling_times(run)
    times = times[: int(times.size * (times[1] * frequency) // 1 / (times[1] * frequency))]
    waves = 2.0 * np.exp(-2j * np.pi * frequency * np.multiply.outer((1, 3), times)) / times.size
    added = {q: (read[q] - plain[q])[: times.size] / PER_NEWTON[q] for q in plain}
    lines = np.array([waves @ series for series in added.values()])
    np.testing.assert_allclose(np.abs(lines), [[30.0, 6.0]] * len(lines), rtol=1e-3)
    assert len(set(np.round(np.angle(lines[:, 0]), 3))) == len(lines)


def test_a_converter_that_averages_twice_is_a_triangle(truth):
    """By the midpoint rule over the plant's own motion; the valve moves on a sample."""
    one = cause("sample-averaging", 0.5, window=0.8)
    plain, read = pair(truth, FREE, one)
    after = 4e-3 * (np.arange(-80, 80) + 0.5) / 80
    weights = (1.0 - np.abs(after) / 4e-3) / 80
    for number in (119, 120, 121):
        states = states_of(truth, number / 100 + after)
        mean = {"load": -truth.rig.k_LC * states[0] @ weights, "pressure": states[4] @ weights}
        for channel, there in mean.items():
            expected = 0.5 * (there - plain[channel][number])
            change = read[channel][number] - plain[channel][number]
            assert change == pytest.approx(expected, abs=1e-4 * np.ptp(plain[channel]))
    assert abs(read["pressure"][120] - plain["pressure"][120]) > 5e-3 * plain["pressure"][120]


def states_of(truth: Truth, times: np.ndarray) -> np.ndarray:
    """The free run's motion without a hidden cause (states, times)."""
    plant = plant_of(truth, FREE)
    return trajectory(plant, plant.at_rest(), np.append(0.0, times)).states[:, 1:]


def test_a_dribbling_valve_passes_its_volume(truth):
    shut_long = replace(FREE, duration=2.2, valve=(Switch(1.2, "open"), Switch(2.2, "shut")))
    plain, more = pair(truth, shut_long, cause("valve-dribble", 0.05, lasting=0.1))
    gained = (more["stroke"] - plain["stroke"])[-1]
    assert gained == pytest.approx(0.05 * 0.1 * SPEED, rel=0.02)
    np.testing.assert_allclose(more["stroke"][:119], plain["stroke"][:119], atol=1e-9)


@pytest.mark.parametrize("name", HIDDEN)
def test_the_page_says_what_the_class_says(name):
    page = (Path(__file__).parents[2] / "docs" / "hidden-causes.md").read_text("utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{name}` |"))
    one = HIDDEN[name]
    kinds = "all" if len(one.kinds) == 4 else ", ".join(one.kinds)
    law = one.law.replace("|", "\\|")
    assert row == f"| `{name}` | {one.equation} | {law} | {kinds} |"


def test_a_strap_that_lets_go_holds_the_mean_for_half_of_its_time(truth):
    """What swings slowly is late by T/2; the momentum lost by then is F_0 T/2."""
    lasts = 1e-5
    sudden, gradual = (
        states(truth, RELEASE, one, np.array([0.0, lasts]))
        for one in (cause("gradual-release", 0.0), cause("gradual-release", lasts))
    )
    mass, (preload, _) = truth.rig.mass_plunger, RELEASE.hook()
    lost = mass * (sudden[3, -1] - gradual[3, -1])
    # within T friction, 1e5 N s/m at some mm/s, takes less than a hundredth of that
    assert lost == pytest.approx(preload * lasts / 2.0, rel=0.01)
