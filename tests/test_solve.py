"""Both ways to a trajectory against a matrix exponential, and against each other."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import MEMORY, NOMINAL, drive, frame_problem, in_full, prior_draws, rig_of
from scipy.linalg import expm

from rigid.likelihood.marginal import marginal_likelihood
from rigid.physics import full, slow
from rigid.physics.drive import STRIDE, require_apart, side_by_side
from rigid.physics.release import ring
from rigid.physics.rest import rest_under
from rigid.physics.rig import Surroundings
from rigid.physics.step_matrices import jacobian, step_column, step_matrix

PSI = 6894.757
BARS = {"load": 29.5, "stroke": 2.2e-5, "pressure": 0.5 * PSI}  # tenths of the sensors' steps
COUNT = 0.05985504150390625  # m/s^2, of the accelerometer


@eqx.filter_jit
def marched(rig, contact, fractions, record):
    return slow.march(rig, contact, fractions, side_by_side((record,)))


rung = eqx.filter_jit(ring)

# A column 10^9 times as long of oil 10^9 times as stiff is the same spring, and frozen: 1 cm of
# stroke changes it by 5e-11. A pump that switches at 10^12 Pa delivers a constant flow.
LINEAR = {"L_0": 0.2e9, "k_oil": 2e18, "p_max": 1e12}
FLOW = (6.645 + 4.965) / 60e3


def linear_parts(v: dict, contact: float, fraction: float) -> tuple[np.ndarray, np.ndarray]:
    """dy/dt = A y + b of the linear rig, by hand from equations (2)-(9)."""
    cylinder, plunger, area = v["M_HC"] - v["M_Pl"], v["M_Pl"] + v["M_Fl"] / 2, v["S_Pl"]
    oil = v["k_oil"] / (area * v["L_0"])
    mu = v["mu"]
    a = np.zeros((7, 7))
    a[0, 1] = a[2, 3] = 1.0
    a[1] = np.array([-v["k_LC"], -mu, 0.0, mu, -area, 1.0, 1.0]) / cylinder
    a[3] = np.array([0.0, mu, -contact, -mu, area, -1.0, -1.0]) / plunger
    a[4, 1], a[4, 3] = oil * area, -oil * area
    for i in (1, 2):
        a[4 + i, 1], a[4 + i, 3] = np.array([-1, 1]) * v[f"mu_branch[{i}]"] / v[f"tau_branch[{i}]"]
        a[4 + i, 4 + i] = -1.0 / v[f"tau_branch[{i}]"]
    b = np.zeros(7)
    b[4] = oil * fraction * FLOW
    return a, b


def advanced(a: np.ndarray, b: np.ndarray, y: np.ndarray, h: float) -> np.ndarray:
    """The state after h: the exponential of the system with the input as one more state."""
    scale = np.append(rig_of(NOMINAL).scales, 1.0)
    whole = np.zeros((8, 8))
    whole[:7, :7], whole[:7, 7] = a, b
    return (
        (expm(whole * (scale / scale[:, None]) * h) * scale[:, None]) @ (np.append(y, 1.0) / scale)
    )[:7]


def exact(v: dict, contact: float, fractions: list[float], record) -> dict[str, np.ndarray]:
    """Channels of a slow record of the linear rig."""
    times = record.times
    y, now, rows, a = np.zeros(7), times[0], [], None
    for t in times:
        marks = [s for s in record.switches if now < s < t]
        for end in (*marks, t):
            level = record.levels[np.searchsorted(record.switches, now, side="right")]
            a, b = linear_parts(v, contact, fractions[level])
            y, now = advanced(a, b, y, end - now), end
        rows.append([-v["k_LC"] * y[0], y[2] - y[0], y[4]])
    return dict(zip(("load", "stroke", "pressure"), np.array(rows).T, strict=True))


RECORD = drive(120, (0.053, 0.497, 0.901), (0, 1, 0, 2))  # switches off the grid of samples
FRACTIONS = [0.0, 0.03, -0.02]


def by_steps(values, contact, fractions, record, names=MEMORY) -> dict[str, np.ndarray]:
    levels = jnp.asarray(fractions)[:, None, None]
    out = marched(
        rig_of(values, names, walkers=True),
        jnp.asarray([contact]),
        levels,
        record,
    )
    return {k: np.asarray(x[: record.samples, 0, 0]) for k, x in out.items()}


@pytest.mark.parametrize("contact", [NOMINAL["k_frame"], 0.0])
@pytest.mark.parametrize("way", ["exponential", "diffrax"])
def test_linear_rig_follows_the_matrix_exponential(way: str, contact: float, monkeypatch):
    values = NOMINAL | LINEAR
    expected = exact(values, contact, FRACTIONS, RECORD)
    if way == "exponential":
        monkeypatch.setattr(slow, "SMOOTH", (0.0,) * 3)  # nothing is: every sample is a step
        eqx.clear_caches()
        got = by_steps(values, contact, FRACTIONS, RECORD)
    else:
        got = in_full(rig_of(values, walkers=True), contact, FRACTIONS, RECORD, 1e-13)
    for name, series in expected.items():
        error = np.abs(np.asarray(got[name]) - series).max() / np.abs(series).max()
        assert error < 1e-8, (name, error)


@pytest.mark.slow
def test_long_steps_are_exact_at_their_nodes_and_below_every_bar_between():
    record = drive(300, (0.013, 0.997), (1, 0, 1))
    values = NOMINAL | LINEAR
    expected = exact(values, NOMINAL["k_frame"], FRACTIONS, record)
    got = by_steps(values, NOMINAL["k_frame"], FRACTIONS, record)
    for name, series in expected.items():
        error = np.abs(got[name] - series)
        assert error[::STRIDE].max() < 1e-8 * np.abs(series).max(), name
        assert error.max() < 0.1 * BARS[name], name
        assert error.max() > 1e3 * error[::STRIDE].max(), name  # there are long steps


def test_linear_release_follows_the_matrix_exponential():
    values, delay, interval = NOMINAL | LINEAR, 2.3e-4, 1 / 1600
    a, b = linear_parts(values, 0.0, 0.0)
    start = np.asarray(rest_under(rig_of(values), jnp.asarray(6e3)))
    times = delay + interval * np.arange(200)
    expected = np.array([a[3] @ advanced(a, b, start, t) for t in times])
    rig = rig_of(values, walkers=True)
    got = rung(rig, jnp.asarray([[6e3]]), jnp.asarray([[delay]]), interval, 200)[:, 0, 0]
    assert np.abs(got - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.mark.parametrize("mu", [2e4, 5e6])
@pytest.mark.parametrize("length", [3e-5, 0.01, 0.08])
def test_step_matrix_is_the_integral_of_the_exponential(mu: float, length: float):
    values = NOMINAL | {"mu": mu}
    rig = rig_of(values, walkers=True)
    scales = np.array(rig.scales)
    outside = Surroundings(jnp.asarray([1e8]))
    matrix = jacobian(rig, outside, jnp.asarray([0.2]))
    got = np.asarray(step_matrix(matrix, jnp.asarray(length), rig.scales))[..., 0]
    n = len(scales)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:] = matrix[..., 0] * scales / scales[:, None], np.eye(n)
    expected = expm(block * length)[:n, n:]
    # A change of one scaled unit in a rate moves the states by this; relative to the largest.
    error = np.abs(got * scales / scales[:, None] - expected)
    assert error.max() < 1e-9 * np.abs(expected).max()


SLOW = {
    "frame": (drive(400, (0.683, 2.041, 2.5), (1, 0, 2, 0)), NOMINAL["k_frame"], [0, 0.1, -0.3]),
    "free-run": (drive(400, (0.203, 2.537), (0, 1, 0)), 0.0, [0, 0.2]),
}
DRAWS = [NOMINAL, *prior_draws(MEMORY, 3, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", SLOW)
@pytest.mark.parametrize("draw", range(4))
def test_steps_follow_the_reference_below_a_tenth_of_a_sensors_step(kind: str, draw: int):
    record, contact, fractions = SLOW[kind]
    values = DRAWS[draw]
    levels = jnp.asarray(fractions, dtype=float)
    expected = in_full(rig_of(values, walkers=True), contact, levels, record, 1e-10)
    got = by_steps(values, contact, fractions, record)
    for name, bar in BARS.items():
        error = np.abs(got[name] - np.asarray(expected[name])).max()
        assert error < bar, (name, error / bar)


@pytest.mark.slow
@pytest.mark.parametrize("draw", range(4))
def test_release_follows_the_reference(draw: int):
    values = DRAWS[draw]
    rig = rig_of(values, walkers=True)
    got = rung(rig, jnp.asarray([[6e3]]), jnp.asarray([[2e-4]]), 1 / 1600, 256)[:, 0, 0]
    expected = full.ring(rig, jnp.asarray([[6e3]]), jnp.asarray([[2e-4]]), 1 / 1600, 256)[:, 0, 0]
    assert np.abs(got - expected).max() < 0.1 * COUNT


@pytest.mark.slow
def test_halving_the_tolerance_moves_no_log_likelihood():
    problem = frame_problem()
    values = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))

    def log_likelihood(tolerance: float) -> float:
        exact = problem.with_tolerance(tolerance)
        return float(marginal_likelihood(problem.pieces, exact.predict(values), values).value[0])

    at_default = log_likelihood(full.TOLERANCE)
    assert abs(log_likelihood(full.TOLERANCE / 2) - at_default) < 0.01
    # What the long steps themselves are off by.
    by_march = float(problem.marginal_likelihood(jnp.zeros((1, problem.parameters.size))).value[0])
    assert abs(by_march - at_default) < 0.3  # its own error, the same at neighbouring values


@pytest.mark.slow
def test_a_switch_counts_from_its_own_instant():
    """The same stretch of pumping, moved by parts of a sample, fills the rig by as much."""
    ends = []
    for shift in (0.0, 0.0025, 0.005, 0.0099):
        record = drive(250, (0.2 + shift, 1.2 + shift), (0, 1, 0))
        ends.append(by_steps(NOMINAL, 0.0, [0.0, 0.1], record)["stroke"][-1])
    expected = 0.1 * FLOW / NOMINAL["S_Pl"]
    np.testing.assert_allclose(ends, expected, rtol=2e-3)
    assert np.ptp(ends) < BARS["stroke"]


def test_two_switches_within_a_sample_are_refused():
    with pytest.raises(ValueError, match="within one sampling interval"):
        require_apart(drive(50, (0.101, 0.106), (0, 1, 0)))


@pytest.mark.parametrize("stiff", [1e2, 1e4, 2e5])
def test_step_column_is_that_of_the_integral(stiff: float):
    """Errors by rounding: exp(A h) doubles 12 times, 4,096 roundings of 1e-16."""
    rng, n, h = np.random.default_rng(8), 7, 0.01
    scales = 10.0 ** rng.uniform(-3.0, 3.0, n)
    balanced = rng.standard_normal((n, n)) - np.diag(np.linspace(0.0, stiff, n))
    both = np.block([[h * balanced, h * np.eye(n)], [np.zeros((n, 2 * n))]])
    exact = expm(both)[:n, n:][:, 4]
    matrix = jnp.asarray(balanced * scales[:, None] / scales)[:, :, None]
    got = np.asarray(step_column(matrix, jnp.asarray([h]), scales.tolist(), 4))[:, 0]
    bar = 4096 * 1e-16 * np.abs(exact).max()
    np.testing.assert_allclose(got * scales[4] / scales, exact, rtol=0.0, atol=bar)
