"""Each effect that can be missing: what it leaves in the records, against equations by hand."""

import re
from functools import lru_cache
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, drive, in_full, march_still, rig_of
from scipy.integrate import quad, solve_ivp

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.__main__ import section
from rigid.effects.base import State
from rigid.physics import full, slow, staggered
from rigid.physics.drive import side_by_side
from rigid.physics.rest import rest_under
from rigid.physics.rig import Surroundings
from rigid.physics.sensors import readings

# What can be missing, and in which equation: part of what scripts may rely on.
NAMES = {
    "coulomb-friction": "plunger-momentum",
    "stribeck-friction": "plunger-momentum",
    "lugre-friction": "plunger-momentum",
    "frequency-dependent-friction": "plunger-momentum",
    "pressure-dependent-friction": "plunger-momentum",
    "return-spring": "plunger-momentum",
    "effective-area": "oil-balance",
    "piston-leakage": "oil-balance",
    "entrained-air": "oil-balance",
    "hose-pressure-drop": "sensor",
    "pump-stage-switch": "pump",
    "pump-slip": "pump",
    "pump-ripple": "pump",
    "valve-event": "pump",
    "load-cell-stiffening": "load-cell",
    "free-root-plate": "root",
    "seating-slack": "contact",
    "stroke-sensor-lag": "sensor",
    "load-cell-drift": "sensor",
    "clock-offset": "sensor",
    "constant-force": "plunger-momentum",
    "direction-dependent-viscosity": "plunger-momentum",
    "shut-valve-leakage": "oil-balance",
    "pressure-gauge-lag": "sensor",
    "load-cell-creep": "sensor",
    "load-cell-hysteresis": "sensor",
    "temperature-drift": "sensor",
    "accelerometer-resonance": "sensor",
    "gradual-release": "contact",
    "mains-pickup": "sensor",
    "sample-averaging": "sensor",
}
PSI = 6894.757
BARS = {"load": 29.5, "stroke": 2.2e-5, "pressure": 0.5 * PSI}  # tenths of the sensors' steps
FLOW = (6.645 + 4.965) / 60e3
SLOW_TEST = (pytest.mark.slow, pytest.mark.long)

# Records of 0.9 s: valve shut, open, shut, and in the free run to the tank. Pumping ends at
# 46 kN, 104 bar and 0.9 mm in the frame, at 2.2 mm in the free run.
RECORDS = {
    "frame": (drive(90, (0.053, 0.503), (0, 1, 0)), NOMINAL["k_frame"], (0.0, 0.1)),
    "free-run": (drive(90, (0.053, 0.303, 0.6), (0, 1, 0, 2)), 0.0, (0.0, 0.2, -0.2)),
}
OPEN, LAST = slice(20, 30), slice(75, 90)

# Effect: values, kind of record, samples, sign of the change in each channel that shows it. The
# other channels stay.
SIGNATURES = {
    "return-spring": (
        {"F_return": 2e3, "k_return": 5e3}, "free-run", OPEN, {"pressure": 1, "stroke": -1},
    ),
    "effective-area": ({"area_excess": 0.02}, "frame", LAST, {"pressure": -1, "load": 1}),
    "piston-leakage": (
        {"C_leak": 5e-14}, "frame", LAST, {"load": -1, "stroke": -1, "pressure": -1},
    ),
    "entrained-air": (
        {"air_fraction": 2e-3}, "frame", LAST, {"load": -1, "stroke": -1, "pressure": -1},
    ),
    "hose-pressure-drop": ({"R_hose": 5e9, "q_fittings": 1e-4}, "frame", OPEN, {"pressure": 1}),
    "pump-stage-switch": (
        {"stage_drop": 1.0, "p_stage": 50e5, "stage_width": 20e5}, "frame", LAST,
        {"load": -1, "stroke": -1, "pressure": -1},
    ),
    "pump-slip": ({"pump_slip": 5e-9}, "frame", LAST, {"load": -1, "stroke": -1, "pressure": -1}),
    "pump-ripple": (
        {"ripple": 0.6, "f_ripple": 3.0}, "frame", OPEN,
        {"load": 1, "stroke": 1, "pressure": 1},
    ),
    "valve-event": (
        {"event_size": 0.3365, "event_start": 0.2, "event_duration": 0.15, "event_edge": 0.05},
        "frame", LAST,
        {"load": 1, "stroke": 1, "pressure": 1},
    ),
    "load-cell-stiffening": (
        {"k_stiffening": 2e10}, "frame", LAST, {"load": 1, "stroke": -1, "pressure": 1},
    ),
    "seating-slack": (
        {"slack": 3e-4}, "frame", LAST, {"load": -1, "stroke": 1, "pressure": -1},
    ),
    "stroke-sensor-lag": ({"tau_stroke": 0.02}, "free-run", OPEN, {"stroke": -1}),
    "load-cell-drift": ({"load_drift": 100.0}, "frame", LAST, {"load": 1}),
    "clock-offset": (
        {"pressure_delay": 0.02, "load_delay_ratio": 0.0}, "frame", OPEN, {"pressure": -1},
    ),
    "constant-force": (
        {"F_constant": 500.0}, "free-run", LAST, {"load": -1, "pressure": -1},
    ),
    "direction-dependent-viscosity": ({"mu_back": 5e4}, "free-run", LAST, {"pressure": -1}),
    "shut-valve-leakage": (
        {"C_valve": 2e-13}, "frame", LAST, {"load": -1, "stroke": -1, "pressure": -1},
    ),
    "pressure-gauge-lag": ({"tau_gauge": 0.02}, "frame", OPEN, {"pressure": -1}),
    "load-cell-creep": ({"creep": 0.01, "tau_creep": 0.5}, "frame", LAST, {"load": 1}),
    "load-cell-hysteresis": (
        {"hysteresis": 400.0, "hysteresis_width": 3e-4}, "frame", LAST, {"load": 1},
    ),
    "sample-averaging": (
        {"averaged": 1.0, "aperture": 0.8}, "free-run", slice(60, 61),
        {"load": -1, "pressure": -1},
    ),
    "temperature-drift": (
        {"thermal_load": 400.0, "thermal_ratio": 200.0, "tau_thermal": 2.0}, "frame", LAST,
        {"load": 1, "pressure": 1},
    ),
}  # fmt: skip
IN_MOTION = {  # what moves otherwise, with whether the check against the reference is quick
    "return-spring": False,
    "effective-area": True,
    "entrained-air": False,
    "pump-stage-switch": False,
    "pump-slip": False,
    "load-cell-stiffening": False,
    "seating-slack": False,
    "piston-leakage": False,
    "stroke-sensor-lag": False,
    "direction-dependent-viscosity": False,
    "pump-ripple": False,
    "valve-event": False,
    "shut-valve-leakage": False,
    "pressure-gauge-lag": False,
    "load-cell-creep": False,
    "load-cell-hysteresis": False,
    "temperature-drift": False,
    "sample-averaging": False,
}


@eqx.filter_jit
def marched(rig, contact, fractions, record, steady):
    march = slow.march if steady else march_still
    return march(rig, contact, fractions, side_by_side((record,)))


def simulated(values, names, kind, steady) -> dict[str, np.ndarray]:
    """Channels of the record of a kind, as a group of records makes them."""
    record, contact, fractions = RECORDS[kind]
    rig = rig_of(values, names, walkers=True)
    levels = jnp.asarray(fractions)[:, None, None]
    out = marched(rig, jnp.asarray([contact]), levels, record, steady)
    return {q: np.asarray(series[: record.samples, 0, 0]) for q, series in out.items()}


@lru_cache
def base(kind: str, steady: bool) -> dict[str, np.ndarray]:
    return simulated(NOMINAL, BASE, kind, steady)


def absent(effect: type[AbstractEffect]) -> dict[str, float]:
    infos = (info for info in effect.parameters() if info.absent is not None)
    return {label: info.absent for info in infos for label in info.labels}


def test_every_name_is_there():
    assert NAMES.items() <= {name: effect.equation for name, effect in CATALOGUE.items()}.items()
    assert set(BASE) <= CATALOGUE.keys()


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_reader_is_told_what_it_is_and_what_its_numbers_mean(name: str):
    effect = CATALOGUE[name]
    assert effect.phrase
    assert all(info.meaning for info in effect.parameters())


@pytest.mark.parametrize("name", SIGNATURES)
def test_signature(name: str):
    values, kind, samples, signs = SIGNATURES[name]
    steady, names = CATALOGUE[name].steady, (*BASE, name)
    reference = base(kind, steady)
    gone = simulated(NOMINAL | values | absent(CATALOGUE[name]), names, kind, steady)
    there = simulated(NOMINAL | values, names, kind, steady)
    alike = 1e-6 if steady or CATALOGUE[name].finer == 1 else 1e-5  # by shorter steps
    for channel, bar in BARS.items():
        assert np.abs(gone[channel] - reference[channel]).max() < alike * bar
        change = there[channel] - reference[channel]
        if channel in signs:
            assert signs[channel] * change[samples].mean() > bar, channel
        else:
            assert abs(change[samples].mean()) < bar, channel


def timed(values, names, kind) -> dict[str, np.ndarray]:
    """Channels by SciPy's Radau, which is told the time; the valve shut where it begins."""
    record, contact, fractions = RECORDS[kind]
    rig = rig_of(values, names)
    scales = np.array(rig.scales)

    @jax.jit
    def rates(time, scaled, fraction):
        outside = Surroundings(contact, 0.0, fraction, time)
        return jnp.stack(rig.motion(scaled * scales, outside).rates) / scales

    slope, rows, y = jax.jit(jax.jacfwd(rates, argnums=1)), [], np.zeros(len(scales))
    bounds = (0.0, *record.switches, record.times[-1] + 1e-9)
    for level, begin, end in zip(record.levels, bounds[:-1], bounds[1:], strict=True):
        inside = record.times[(record.times >= begin) & (record.times < end)]
        path = solve_ivp(
            rates, (begin, end), y, "Radau", [*inside, end], args=(fractions[level],),
            jac=slope, rtol=1e-8, atol=1e-8, max_step=0.02,
        ).y  # fmt: skip
        for at, flat in zip(inside, path.T, strict=False):
            outside = Surroundings(contact, 0.0, fractions[level], at)
            rows.append(readings(rig, jnp.asarray(flat * scales), outside)[:3])
        y = path[:, -1]
    return dict(zip(BARS, np.array(rows, dtype=float).T, strict=True))


@pytest.mark.parametrize(
    "name", [n if quick else pytest.param(n, marks=SLOW_TEST) for n, quick in IN_MOTION.items()]
)
def test_steps_follow_the_reference_below_a_tenth_of_a_sensors_step(name: str):
    values, kind, *_ = SIGNATURES[name]
    names = (*BASE, name)
    got = simulated(NOMINAL | values, names, kind, CATALOGUE[name].steady)
    if name in ("pump-ripple", "valve-event"):  # the other reference knows no time
        expected = timed(NOMINAL | values, names, kind)
    else:
        record, contact, fractions = RECORDS[kind]
        rig = rig_of(NOMINAL | values, names, walkers=True)
        expected = in_full(rig, contact, fractions, record)
    for channel, bar in BARS.items():
        error = np.abs(got[channel] - np.asarray(expected[channel])).max()
        assert error < bar, (channel, error / bar)


# In the frame's hold everything is at rest: load = S p, the stroke is load (1/k_LC + 1/k_frame).
SPRINGS = 1 / NOMINAL["k_LC"] + 1 / NOMINAL["k_frame"]
PUMPED = 0.1 * FLOW * 0.45


def held_volume(pressure: float, area: float, air: float = 0.0) -> float:
    """Oil [m^3] to fill the frame's springs and the compression up to a pressure [Pa]."""
    nominal, column = NOMINAL["S_Pl"], NOMINAL["L_0"]

    def give(p: float) -> float:
        gas = air * 101325.0 / (101325.0 + p) ** 2
        return nominal * (column + area * p * SPRINGS) * (1 / NOMINAL["k_oil"] + gas)

    return area**2 * pressure * SPRINGS + quad(give, 0.0, pressure, epsrel=1e-10)[0]


@pytest.mark.parametrize(("name", "factor"), [("effective-area", 1.02), ("entrained-air", 1.0)])
def test_all_oil_that_was_pumped_is_somewhere(name: str, factor: float):
    values, kind, *_ = SIGNATURES[name]
    out = simulated(NOMINAL | values, (*BASE, name), kind, CATALOGUE[name].steady)
    area, pressure = factor * NOMINAL["S_Pl"], float(out["pressure"][-1])
    assert out["load"][-1] == pytest.approx(area * pressure, abs=BARS["load"])
    assert out["stroke"][-1] == pytest.approx(area * pressure * SPRINGS, abs=0.1 * BARS["stroke"])
    # The rounding of the gas law at vacuum takes 1 % of the gas that is squeezed near 0 bar.
    slack = 0.02 * NOMINAL["S_Pl"] * NOMINAL["L_0"] * values.get("air_fraction", 0.0)
    filled = held_volume(pressure, area, values.get("air_fraction", 0.0))
    assert filled == pytest.approx(PUMPED, rel=5e-4, abs=slack)


def test_effective_area_is_a_rig_with_that_area_and_the_same_oil():
    flat, outside = jnp.asarray([-1e-4, 0.02, 2e-4, 0.03, 4e6]), Surroundings(1e7, -3e4, 0.4)
    column = jnp.asarray(0.21)
    rig = rig_of(NOMINAL | {"area_excess": 0.02}, (*BASE, "effective-area"))
    other = rig_of(NOMINAL | {"S_Pl": 1.02 * NOMINAL["S_Pl"]}, BASE)
    got = rig.motion(flat, outside, column).rates
    np.testing.assert_allclose(got, other.motion(flat, outside, column / 1.02).rates, rtol=1e-12)


def test_leakage_lets_a_hold_down_exponentially():
    values, kind, *_ = SIGNATURES["piston-leakage"]
    p = simulated(NOMINAL | values, (*BASE, "piston-leakage"), kind, True)["pressure"]
    area, mid = NOMINAL["S_Pl"], p[70:].mean()
    volume = area * (NOMINAL["L_0"] + area * mid * SPRINGS)
    rate = values["C_leak"] / (area**2 * SPRINGS + volume / NOMINAL["k_oil"])
    assert np.log(p[70] / p[89]) == pytest.approx(0.19 * rate, rel=5e-3)


def test_lagging_sensor_is_a_low_pass_of_the_stroke():
    values, kind, *_ = SIGNATURES["stroke-sensor-lag"]
    out = simulated(NOMINAL | values, (*BASE, "stroke-sensor-lag"), kind, True)
    tau = values["tau_stroke"]
    behind = base(kind, True)["stroke"] - out["stroke"]
    speed = 0.2 * FLOW / NOMINAL["S_Pl"]
    assert behind[29] == pytest.approx(speed * tau, rel=5e-3)
    # From a stop, by e each T = hypot(tau, 1 ms).
    expected = np.exp(-0.06 / np.hypot(tau, 1e-3))
    assert behind[40] / behind[34] == pytest.approx(expected, rel=5e-2)


def test_ripple_is_the_integral_of_the_flow():
    values, kind, *_ = SIGNATURES["pump-ripple"]
    out = simulated(NOMINAL | values, (*BASE, "pump-ripple"), kind, False)
    change = out["pressure"][6:50] - base(kind, False)["pressure"][6:50]
    w, t = 2 * np.pi * values["f_ripple"], RECORDS[kind][0].times[6:50]
    oil = values["ripple"] * 0.1 * FLOW * (np.cos(w * 0.053) - np.cos(w * t)) / w
    expected = oil / (NOMINAL["S_Pl"] ** 2 * SPRINGS + NOMINAL["S_Pl"] * 0.2005 / NOMINAL["k_oil"])
    # Friction mu v and the ringing of the valve's opening ride on it: a few percent of the peak.
    assert np.abs(change - expected).max() < 0.05 * expected.max()


def released(values, names) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations after a release of 6 kN by steps and by the reference, 40 samples."""
    interval, ring = 1 / 1600, eqx.filter_jit(staggered.ring)
    rig = rig_of(values, names, walkers=True)
    stepped = ring(rig, jnp.asarray([[6e3]]), jnp.asarray([[2e-4]]), interval, 40)
    solved = full.ring(rig, jnp.asarray([[6e3]]), jnp.asarray([[2e-4]]), interval, 40)
    return np.asarray(stepped[:, 0, 0]), np.asarray(solved[:, 0, 0])


def test_free_root_swings_as_three_masses_on_two_springs():
    """Periods against the chain root - k_LC - cylinder - oil - plunger, without friction."""
    mass = 175.0
    values = NOMINAL | {"mu": 0.0, "inverse_M_root": 1 / mass}
    rig = rig_of(values, (*BASE, "free-root-plate"))
    scales = np.array(rig.scales)

    def rates(y):
        return jnp.stack(rig.motion(y * scales, Surroundings(), rig.column).rates) / scales

    found = np.sort(np.abs(np.linalg.eigvals(np.asarray(jax.jacfwd(rates)(jnp.zeros(7))))))
    k, oil = NOMINAL["k_LC"], NOMINAL["k_oil"] * NOMINAL["S_Pl"] / NOMINAL["L_0"]
    stiffness = np.array([[k, -k, 0], [-k, k + oil, -oil], [0, -oil, oil]])
    chain = np.linalg.eigvals(np.diag(1 / np.array([mass, 50.0, 110.0])) @ stiffness)
    expected = np.sqrt(np.sort(np.abs(chain))[1:])
    np.testing.assert_allclose(found[[-3, -1]], expected, rtol=1e-9)
    assert 9e-3 < 2 * np.pi / expected[0] < 11e-3  # the 10 ms of Fig. 8


def test_free_root_keeps_the_momentum():
    values = NOMINAL | {"inverse_M_root": 1 / 175.0}
    rig = rig_of(values, (*BASE, "free-root-plate"))
    times = jnp.linspace(0.0, 0.02, 21)
    start = rest_under(rig, 6e3)
    path = np.asarray(full.integrate(rig, Surroundings(), start, times))
    parts = path[:, [1, 3, 6]] * np.array([50.0, 110.0, 175.0])
    assert np.abs(parts.sum(axis=1)).max() < 1e-5 * np.abs(parts).max()
    assert np.abs(parts[:, 2]).max() > 0.1 * np.abs(parts[:, 1]).max()  # it does move


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("free-root-plate", {"inverse_M_root": 1 / 175.0}),
        ("entrained-air", {"air_fraction": 2e-3}),
        ("direction-dependent-viscosity", {"mu_back": 5e4}),
    ],
)
def test_release_follows_the_reference(name: str, values: dict):
    got, expected = released(NOMINAL | values, (*BASE, name))
    assert np.abs(got - expected).max() < 0.35 / 3  # a third of a sample's noise


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("coulomb-friction", {"bending": 2e-5}),
        ("stribeck-friction", {"excess": 0.5, "speed": 2e-3, "bending": 2e-5}),
        ("lugre-friction", {"excess": 0.5, "speed": 2e-3, "bending": 1e-4, "delay": 2e-3}),
    ],
)
def test_dry_friction_is_in_proportion_to_its_force(name: str, shape: dict[str, float]):
    """Discovery takes the trace of a force from its slope where there is none."""
    still = {k: jnp.asarray(0.0) for k in ("x_cylinder", "x_plunger", "pressure", "column")}
    state = State(**still, v_cylinder=jnp.asarray(0.0), v_plunger=jnp.asarray(1e-3))
    given = {k: jnp.asarray(v) for k, v in shape.items()}

    def acting(force: float) -> float:
        effect = CATALOGUE[name](force=jnp.asarray(force), **given)
        return float(effect(state, (jnp.asarray(0.4),)).between)

    assert acting(500.0) == pytest.approx(500.0 * acting(1.0), rel=1e-12)


PAGE = Path(__file__).parents[1] / "docs" / "catalogue.md"


def test_page_says_what_the_classes_say():
    """Of every effect that it has; one that was added since is no fault of the tests'."""
    text = PAGE.read_text(encoding="utf-8")
    told = re.findall(r"^## (\S+)$", text, re.MULTILINE)
    assert NAMES.keys() <= set(told) <= CATALOGUE.keys()
    for name in told:
        assert section(CATALOGUE[name]) in text, "python -m rigid.effects --write docs/catalogue.md"
