"""Short exponential steps: against a matrix exponential, and LSODA with what is not linear."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, MEMORY, NOMINAL, SHEETS, drive, march_still, rig_of
from scipy.integrate import odeint
from test_solve import BARS, FRACTIONS, LINEAR, RECORD, exact

from rigid.effects.bristle import share_rate
from rigid.physics import full, release, rubbing, staggered
from rigid.physics.drive import side_by_side
from rigid.physics.rig import Surroundings
from rigid.physics.sensors import readings

DRY = {
    "coulomb-friction": {"F_C": 800.0, "presliding": 2e-5},
    "stribeck-friction": {
        "F_C": 800.0, "stribeck_excess": 0.5, "v_stribeck": 2e-3, "presliding": 2e-5,
    },
    "lugre-friction": {
        "F_C": 800.0, "stribeck_excess": 0.5, "v_stribeck": 2e-3,
        "z_bristle": 1e-4, "bristle_time": 2e-3,
    },
    "pressure-dependent-friction": {"c_seal": 1e-4, "presliding_seal": 2e-5},
}  # fmt: skip
# Pumping, a hold under a shut valve, letting off: the plunger starts, sticks and turns.
TURNING = drive(140, (0.203, 0.637, 0.9), (0, 1, 0, 2))
FLOWS = [0.0, 0.1, -0.2]
FLOWING = jnp.asarray(FLOWS)[:, None, None]
ANGLE = 0.3
"""At which the pump stood when the record began [rad]; only what beats knows of it."""


@eqx.filter_jit
def marched(rig, contact, fractions, record):
    angles = jnp.full_like(fractions[0], ANGLE)
    return staggered.march(rig, contact, fractions, side_by_side((record,)), angles)


def by_steps(values, names, contact: float, flows, record) -> dict[str, np.ndarray]:
    rig = rig_of(values, names, walkers=True)
    out = marched(rig, jnp.asarray([contact]), jnp.asarray(flows)[:, None, None], record)
    return {k: np.asarray(x[: record.samples, 0, 0]) for k, x in out.items()}


def by_lsoda(values, names, contact: float, flows, record) -> dict[str, np.ndarray]:
    """The same record by SciPy, restarted at every switch."""
    rig = rig_of(values, names)
    scales = np.array(rig.scales)

    @jax.jit
    def rates(scaled, flow, time):
        moved = rig.motion(scaled * scales, Surroundings(contact, 0.0, flow, time, ANGLE)).rates
        return jnp.stack([jnp.broadcast_to(r, ()) for r in moved]) / scales

    flat, rows = np.zeros(len(scales)), []
    bounds = (record.first, *record.switches, np.inf)
    for level, begin, end in zip(record.levels, bounds[:-1], bounds[1:], strict=True):
        inside = record.times[(record.times >= begin) & (record.times < end)]
        times = np.unique([begin, *inside, min(end, record.times[-1])])
        path = odeint(
            lambda y, t, flow: np.asarray(rates(y, flow, t)), flat, times, args=(flows[level],),
            rtol=1e-9, atol=1e-9, tcrit=times[-1:], mxstep=1_000_000,
        )  # fmt: skip
        for t, y in zip(inside, path[np.searchsorted(times, inside)], strict=True):
            outside = Surroundings(contact, 0.0, flows[level], t, ANGLE)
            rows.append(readings(rig, jnp.asarray(y * scales), outside)[:3])
        flat = path[-1]
    return dict(zip(("load", "stroke", "pressure"), np.array(rows, dtype=float).T, strict=True))


def worst(got: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> float:
    """Greatest error, in tenths of the sensors' steps."""
    return max(np.abs(got[k] - expected[k]).max() / bar for k, bar in BARS.items())


@pytest.mark.parametrize("contact", [NOMINAL["k_frame"], 0.0])
def test_linear_rig_follows_the_matrix_exponential(contact: float):
    values = NOMINAL | LINEAR
    expected = exact(values, contact, FRACTIONS, RECORD)
    got = by_steps(values, MEMORY, contact, FRACTIONS, RECORD)
    for name, series in expected.items():
        error = np.abs(got[name] - series).max() / np.abs(series).max()
        assert error < 1e-8, (name, error)


SMOOTH = {
    "entrained-air": {"air_fraction": 5e-3},
    "seating-slack": {"slack": 1e-3},
    "load-cell-stiffening": {"k_stiffening": 1e10},
    "pump-ripple": {"ripple": 0.05, "f_ripple": 8.0},
    "valve-event": {
        "event_size": 0.4,
        "event_start": 0.4,
        "event_duration": 0.1,
        "event_edge": 0.05,
    },
    "pump-stage-switch": {"stage_drop": 1.0, "p_stage": 40e5, "stage_width": 20e5},
    "direction-dependent-viscosity": {"mu_back": 1e5},
    "return-spring": {"F_return": 1e3, "k_return": 5e3},
}
FRAME = NOMINAL["k_frame"]
QUICK = {("coulomb-friction", 0.0), ("seating-slack", FRAME)}
UNSEEN = {
    ("entrained-air", 0.0),
    ("load-cell-stiffening", 0.0),
    ("seating-slack", 0.0),
    ("pressure-dependent-friction", 0.0),
    ("pump-stage-switch", 0.0),
    ("pump-ripple", 0.0),
}
"""Too little happens out of load for these to be seen at all."""


def cases():
    for name in (*DRY, *SMOOTH):
        for contact in (0.0, FRAME):
            # Out of load little happens that the frame does not show as well.
            later = (pytest.mark.slow,) if contact else (pytest.mark.slow, pytest.mark.long)
            marks = () if (name, contact) in QUICK else later
            yield pytest.param(name, contact, marks=marks)


@pytest.mark.parametrize(("name", "contact"), list(cases()))
def test_follows_the_reference_to_a_tenth_of_a_sensors_step(name: str, contact: float):
    """To a fiftieth without dry friction: with one stiffness of the oil, air would miss that, with
    half of the steps, slack."""
    values, names = NOMINAL | (DRY | SMOOTH)[name], (*BASE, name)
    expected = by_lsoda(values, names, contact, FLOWS, TURNING)
    most = 1.0 if name in DRY else 0.2
    assert worst(by_steps(values, names, contact, FLOWS, TURNING), expected) < most
    without = by_steps(NOMINAL, BASE, contact, FLOWS, TURNING)
    if (name, contact) not in UNSEEN:
        assert worst(without, expected) > 2.0  # the effect is seen, and the check can fail


def test_a_pump_that_changes_its_stage_follows_the_reference():
    """In the frame the pressure passes p_max; step matrices made at rest would be far off."""
    record, values = drive(140, (0.203, 1.2), (0, 1, 0)), NOMINAL | {"p_max": 40e5}
    expected = by_lsoda(values, BASE, NOMINAL["k_frame"], FLOWS, record)
    assert expected["pressure"].max() > 60e5
    assert worst(by_steps(values, BASE, NOMINAL["k_frame"], FLOWS, record), expected) < 1.0


@pytest.mark.slow
def test_errors_fall_with_the_square_of_the_step(monkeypatch):
    """Half the step, a quarter of the error: a plunger on stiff bristles breaks loose and slides,
    and its oil column grows."""
    stiff = {"F_C": 2500.0, "presliding": 1e-6}
    values, names = NOMINAL | stiff, (*MEMORY, "coulomb-friction")
    rig, record = rig_of(values, names, walkers=True), drive(300, (0.203,), (0, 1))
    flows = jnp.asarray([0.0, 0.3])[:, None, None]

    def cut_in(parts: int) -> dict[str, np.ndarray]:
        monkeypatch.setattr(staggered, "DRY", staggered.Cut(parts, parts))
        how = (rig, jnp.asarray([0.0]), flows, side_by_side((record,)))
        found = eqx.filter_jit(lambda *given: march_still(*given))(*how)
        return {k: np.asarray(x) for k, x in found.items()}

    finest = cut_in(128)
    coarse, fine = (worst(cut_in(parts), finest) for parts in (8, 16))
    assert coarse / fine > 3.0, (coarse, fine)


def test_a_stuck_plunger_keeps_its_force():
    """Nothing creeps: over minutes of hold the share of the bristle is what it was."""
    assert float(share_rate(jnp.asarray(0.7), jnp.asarray(0.0), 2e-5)) == 0.0
    values, names = NOMINAL | DRY["coulomb-friction"], (*BASE, "coulomb-friction")
    rig = rig_of(values, names)
    share = 0.6
    # At rest with the valve shut: the oil carries what the friction does not.
    flat = jnp.zeros(6).at[5].set(share).at[4].set(share * 800.0 / NOMINAL["S_Pl"])
    (bristle,) = staggered.Parted.of(rig).bristles
    end, force = rubbing.led(bristle, rig.state(flat), flat[5], 240.0)
    assert (float(end), float(force)) == (share, -800.0 * share)
    assert max(abs(float(r)) for r in rig.motion(flat, Surroundings()).rates) < 1e-9


def test_bristles_are_led_exactly_at_a_slip_that_stays():
    """Share and mean force against their integrals: ds/dt = (v - |v| s)/z from 0.3."""
    values, names = NOMINAL | DRY["coulomb-friction"], (*BASE, "coulomb-friction")
    rig = rig_of(values, names)
    (bristle,) = staggered.Parted.of(rig).bristles
    for slip in (3e-3, -3e-3, 1e-5):
        state = rig.state(jnp.zeros(6).at[3].set(slip))
        end, force = rubbing.led(bristle, state, jnp.asarray(0.3), 0.01)
        decay = np.exp(-abs(slip) * np.linspace(0.0, 0.01, 20001) / 2e-5)
        path = np.sign(slip) + (0.3 - np.sign(slip)) * decay  # |v| is rounded by 1e-7 m/s
        assert float(end) == pytest.approx(path[-1], abs=0.02 if slip == 1e-5 else 1e-4)
        mean = np.trapezoid(path, dx=1.0 / 20000)
        assert float(force) == pytest.approx(-800.0 * mean, rel=0.02 if slip == 1e-5 else 1e-4)


STIFF = [(2500.0, 1e-5), (2500.0, 1e-6), (2500.0, 2e-7)]
"""Forces [N] and bendings [m] of bristles that are up to 280 times as stiff as the oil."""


@pytest.mark.slow
@pytest.mark.parametrize(("force", "bending"), STIFF)
def test_stiff_bristles_follow_the_reference_to_a_tenth_of_a_step(force: float, bending: float):
    """A step that leads bristles at the slip of its beginning is off by 8 steps at 1 um, one that
    leads them at the slip in its middle by 0.18: they bend by how far the plunger slides."""
    names = (*BASE, "coulomb-friction")
    values = NOMINAL | {"F_C": force, "presliding": bending}
    expected = by_lsoda(values, names, NOMINAL["k_frame"], FLOWS, TURNING)
    got = by_steps(values, names, NOMINAL["k_frame"], FLOWS, TURNING)
    assert worst(got, expected) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("bending", "most"), [(2e-5, 0.01), (1e-6, 0.1)])
def test_a_release_on_stiff_bristles_follows_diffrax(bending: float, most: float):
    """2,500 N; to a share of the accelerometer's noise."""
    values = NOMINAL | {"F_C": 2500.0, "presliding": bending}
    rig = rig_of(values, (*BASE, "coulomb-friction"), walkers=True)
    how = (jnp.asarray([[6e3]]), jnp.asarray([[2e-4]]), 1 / 1600, 128)
    got = np.asarray(eqx.filter_jit(staggered.ring)(rig, *how))
    expected = np.asarray(full.ring(rig, *how, tolerance=1e-9))
    assert np.abs(got - expected).max() < most * SHEETS["acceleration"].noise


def test_intervals_of_a_part_of_a_sample_are_cut_into_no_more_steps():
    """A gradual release asks for sixteen intervals a sample: not for sixteen times the steps."""
    rig = rig_of(NOMINAL | DRY["coulomb-friction"], (*BASE, "coulomb-friction"), walkers=True)
    how, interval = (rig, jnp.asarray([[6e3]]), jnp.asarray([[1e-7]])), 1 / 1600
    whole = eqx.filter_jit(staggered.ring)(*how, interval, 24)
    parts = eqx.filter_jit(staggered.ring)(*how, interval / 16, 16 * 24, among=16)
    scale = float(jnp.abs(whole).max())
    np.testing.assert_allclose(parts[::16], whole, rtol=0.0, atol=1e-7 * scale)


def test_slopes_by_a_rigs_numbers_are_those_of_differences():
    """A step solves for its slip; derivatives are those of the steps toward it."""
    names, steps = (*BASE, "coulomb-friction"), {"F_C": 1.0, "presliding": 1e-10, "k_oil": 1e4}
    values = NOMINAL | {"F_C": 2500.0, "presliding": 1e-6}

    def load(values):
        record = drive(40, (0.203, 0.637), (0, 1, 0))
        out = marched(
            rig_of(values, names, True), jnp.asarray([NOMINAL["k_frame"]]), FLOWING, record
        )
        return out["load"][:, 0, 0]

    for label, step in steps.items():
        start = {k: jnp.asarray(float(v)) for k, v in values.items()}
        ahead = {k: jnp.asarray(float(k == label)) for k in values}
        slope = jax.jvp(load, (start,), (ahead,))[1]
        up, down = (load(start | {label: start[label] + s}) for s in (step, -step))
        by_difference = (up - down) / (2.0 * step)
        scale = float(jnp.abs(by_difference).max())
        assert scale > 0.0
        assert float(jnp.abs(slope - by_difference).max()) < 1e-3 * scale, label


@pytest.mark.slow
def test_release_of_a_linear_rig_is_that_of_the_matrix_exponential():
    rig = rig_of(NOMINAL | LINEAR, walkers=True)
    how = (jnp.asarray([[6e3]]), jnp.asarray([[2e-4]]), 1 / 1600, 128)
    got = np.asarray(eqx.filter_jit(staggered.ring)(rig, *how))
    expected = np.asarray(eqx.filter_jit(release.ring)(rig, *how))
    assert np.abs(got - expected).max() < 1e-8 * np.abs(expected).max()
