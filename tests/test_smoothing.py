"""The smoother against a dense Gaussian, its steps against an ODE solver, and its parts alone."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import NOMINAL, effects
from scipy.integrate import solve_ivp
from scipy.stats import multivariate_normal, norm

from rigid.physics.rig import Surroundings, build_rig
from rigid.smoothing import budget, kalman, latent, model, quantised
from rigid.smoothing.field import rig_setup
from rigid.smoothing.interval import at_place, intervals
from rigid.smoothing.jumps import at_once, jumps
from rigid.smoothing.kalman import Backward, BlockRun, Filtered, Samples
from rigid.smoothing.mixture import LEVELS, Mixture, Moments, quantiles
from rigid.smoothing.model import Calibration
from rigid.smoothing.plant import RigPlant, Rough
from rigid.smoothing.run import _within
from rigid.smoothing.states import States

STEPS, SAMPLES = 2, 6
INTERVAL = 0.01
ROUNDING = 1e-12
"""Of what is nothing but rounding, in units of the state's sizes: a drift where all is linear."""


@pytest.fixture(scope="module")
def rig():
    return RigPlant(rig=build_rig(effects(), NOMINAL), inputs=rig_setup("A").inputs)


def path_of(*series):
    """A path of stroke, speed and pressure at the nodes."""
    return Rough(*(jnp.array(one)[:, None] for one in series), jnp.zeros((len(series[0]), 0)))


@pytest.fixture(scope="module")
def table(rig):
    path = path_of([0.01, 0.01], [0.008, 0.008], [2e6, 2e6])
    sensors = Calibration(jnp.array([1e-3, -2e-3, 5e-4]), jnp.array([50.0, 1e-5, 2e3]))
    return model.nodes(rig, path, sensors, INTERVAL / STEPS)


@pytest.mark.slow
def test_a_step_is_the_rigs_own_motion(rig, table):
    size = np.asarray(model.scales(rig))
    n = len(rig.scales)
    rng = np.random.default_rng(1)
    start = size * rng.standard_normal(n + 3)
    load, slope, kappa = start[n:]

    def rates(t, flat):
        outside = Surroundings(0.0, -(load + slope * t), kappa)
        return np.stack(rig.rig.motion(jnp.asarray(flat), outside, rig.rig.column + 0.01).rates)

    length = INTERVAL / STEPS
    exact = solve_ivp(
        rates, (0.0, length), start[:n], "Radau", rtol=1e-10, atol=1e-10 * size[:n]
    ).y[:, -1]
    found = (np.asarray(table.step[0]) @ (start / size) + np.asarray(table.drift[0])) * size
    np.testing.assert_allclose(found[:n] / size[:n], exact / size[:n], atol=1e-6, rtol=1e-6)
    np.testing.assert_allclose(found[n:], [load + slope * length, slope, kappa], rtol=1e-12)


@pytest.mark.slow
def test_an_interval_between_nodes_is_its_steps(rig):
    """Intervals are interpolated, not the steps that they are made of. In 0.16 s at 8 mm/s the oil
    column changes by 0.6 %; what is left out is of second order, (0.6 %)^2 / 8 = 5e-6."""
    path = path_of([0.01, 0.01128], [0.008, 0.008], [2e6, 2e6])
    sensors = Calibration(jnp.zeros(3), jnp.zeros(3))
    ends = model.nodes(rig, path, sensors, INTERVAL / STEPS)
    middle = jax.tree.map(lambda leaf: leaf.mean(axis=0, keepdims=True), ends)
    rows = model.shown(rig)
    left, right = (
        jax.tree.map(lambda leaf, i=i: leaf[i], intervals(ends, rows, STEPS)) for i in (0, 1)
    )
    change = jax.tree.map(jnp.subtract, right, left)
    found = at_place(left, change, jnp.array(0.5))
    for name, exact in intervals(middle, rows, STEPS)._asdict().items():
        size = np.abs(exact[0]).max()
        off = np.abs(getattr(found, name) - exact[0]).max()
        assert off <= 1e-5 * size + ROUNDING, name


@pytest.fixture(scope="module")
def block(table):
    """A short record with a hole in it."""
    rng = np.random.default_rng(2)
    known = np.ones((SAMPLES, 3))
    known[2, 1] = known[4] = 0.0
    variance = np.tile(np.square([170.0, 8e-5, 1.5e4]), (SAMPLES, 1))
    reading = np.sqrt(variance) * rng.standard_normal((SAMPLES, 3)) * 20.0
    moves = np.exp(rng.uniform(-4, 2, (SAMPLES, 3)))
    place = np.linspace(0.0, 0.9, SAMPLES)
    samples = Samples(place, reading, variance, known, np.arange(SAMPLES))
    return samples, moves


def smoothed(rig, table, block):
    samples, moves = block
    n = len(rig.scales) + 3
    rows = model.shown(rig)
    batch = jax.tree.map(lambda leaf: leaf[None], intervals(table, rows, STEPS))
    keys = jax.random.split(jax.random.key(3), 1)
    run = BlockRun(samples, jnp.asarray(moves)[None], batch, keys)
    start = Filtered(jnp.zeros((1, n, 3)), jnp.eye(n)[None] * 0.3, jnp.zeros((1, n)), jnp.zeros(1))
    last = kalman.forward(start, run)
    later = Backward(jnp.zeros((1, n, 3)), jnp.zeros((1, n, n)))
    _, found = kalman.backward(later, start, run)
    return jax.tree.map(lambda leaf: np.asarray(leaf[0]), found), float(last.evidence[0]), rows


def dense(rig, table, block):
    """Means and covariance of all states and movements, and of the readings, written out."""
    samples, moves = block
    n, count = len(rig.scales) + 3, SAMPLES * STEPS
    size = n + 3 * count
    state, offset = np.zeros((count, n, size)), np.zeros((count, n))
    state[0, :, :n] = np.eye(n)
    sense, sense_offset = [], []
    for k in range(SAMPLES):
        at = jax.tree.map(lambda leaf: np.asarray(leaf[0]), table)
        sense.append(at.sense)
        sense_offset.append(at.offset)
        for j in range(STEPS):
            i = k * STEPS + j
            if i + 1 < count:
                state[i + 1] = at.step @ state[i]
                offset[i + 1] = at.step @ offset[i] + at.drift
                state[i + 1][:, n + 3 * i : n + 3 * i + 3] += at.entry
    prior = np.concatenate([np.full(n, 0.3), np.repeat(moves, STEPS, axis=0).ravel()])
    rows, means, kept = [], [], []
    for k in range(SAMPLES):
        for q in range(3):
            if samples.known[k, q]:
                rows.append(sense[k][q] @ state[k * STEPS])
                means.append(sense[k][q] @ offset[k * STEPS] + sense_offset[k][q])
                kept.append((k, q))
    return state, offset, prior, np.array(rows), np.array(means), kept


def test_the_smoother_is_the_dense_gaussian(rig, table, block):
    samples, _ = block
    found, evidence, rows = smoothed(rig, table, block)
    state, offset, prior, sense, means, kept = dense(rig, table, block)
    noise = np.array([samples.variance[k] for k in kept])
    read = np.array([samples.reading[k] for k in kept]) - means
    total = (sense * prior) @ sense.T + np.diag(noise)
    gain = (prior[:, None] * sense.T) @ np.linalg.inv(total)
    mean = gain @ read
    covariance = np.diag(prior) - gain @ (sense * prior)
    sd = np.sqrt(noise)  # newtons and metres in one covariance would look singular
    density = multivariate_normal.logpdf(read / sd, cov=total / np.outer(sd, sd))
    assert evidence == pytest.approx(density - np.log(sd).sum(), rel=1e-8)
    shown = np.asarray(rows) @ state
    expected = (shown @ mean + (np.asarray(rows) @ offset[..., None])[..., 0]).reshape(
        SAMPLES, STEPS, 3
    )
    variance = np.einsum("ijk,kl,ijl->ij", shown, covariance, shown).reshape(SAMPLES, STEPS, 3)
    np.testing.assert_allclose(found.shown.mean, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found.shown.variance, variance, rtol=1e-5, atol=1e-14)
    n = state.shape[1]
    moved = mean[n:].reshape(SAMPLES, STEPS, 3)
    spread = np.diag(covariance)[n:].reshape(SAMPLES, STEPS, 3)
    last = SAMPLES * STEPS - 1  # what moves after the last told step is seen by nothing
    np.testing.assert_allclose(
        found.moved.reshape(-1, 3)[:last], moved.reshape(-1, 3)[:last], atol=1e-8
    )
    np.testing.assert_allclose(
        found.moved_variance.reshape(-1, 3)[:last], spread.reshape(-1, 3)[:last], rtol=1e-6
    )
    where = tuple(np.array(kept).T)
    told = np.einsum("ij,jk,ik->i", sense, covariance, sense)
    np.testing.assert_allclose(found.read[where], sense @ mean + means, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found.read_variance[where], told, rtol=1e-5)


def test_a_smoother_that_ignores_later_samples_is_another(rig, table, block):
    """The dense test above can fail: without the last reading means differ by part of an sd."""
    samples, moves = block
    known = samples.known.copy()
    known[-1] = 0.0
    found, _, _ = smoothed(rig, table, block)
    less, _, _ = smoothed(rig, table, (samples._replace(known=known), moves))
    off = np.abs(found.shown.mean - less.shown.mean) / np.sqrt(found.shown.variance)
    assert off.max() > 0.1


@pytest.mark.slow
def test_simulated_errors_have_the_smoothers_variance(rig, table, block):
    """Own movement and noise together: over 4,000 keys the variance is within 5 sds of its own."""
    samples, moves = block
    n, count = len(rig.scales) + 3, 4000
    steps = intervals(table, model.shown(rig), STEPS)
    wide = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (count, *leaf.shape)), steps)
    keys = jax.random.split(jax.random.key(4), count)
    run = BlockRun(samples, jnp.broadcast_to(jnp.asarray(moves), (count, *moves.shape)), wide, keys)
    first = jnp.sqrt(0.3) * jax.random.normal(jax.random.key(5), (count, n))
    start = Filtered(
        jnp.zeros((count, n, 3)), jnp.broadcast_to(0.3 * jnp.eye(n), (count, n, n)), first,
        jnp.zeros(count),
    )  # fmt: skip
    later = Backward(jnp.zeros((count, n, 3)), jnp.zeros((count, n, n)))
    _, found = kalman.backward(later, start, run)
    assert found.shown is not None
    error = np.asarray(found.shown.own + found.shown.noise)
    ratio = error.var(axis=0) / np.asarray(found.shown.variance[0])
    assert np.abs(ratio - 1.0).max() < 5.0 * np.sqrt(2.0 / count)
    own = np.asarray(found.shown.own).var(axis=0) / np.asarray(found.shown.variance[0])
    assert np.abs(own - 1.0).max() > 0.2


# The law of the movements


def test_a_jump_gets_a_variance_of_its_own_and_calm_keeps_its_scale():
    movement = latent.calm(50, 4, np.full(3, 0.01))
    moved, variance = np.zeros((50, 4, 3)), np.full((50, 4, 3), 0.01**2 / 4)
    moved[20, :, 0] = 1.0
    after = latent.updated(movement, moved, variance)
    assert after.variances[20, 0] * 4 > 1.0
    np.testing.assert_allclose(np.delete(after.variances[:, 0], 20) * 4, 0.01**2, rtol=1e-9)
    np.testing.assert_allclose(after.variances[:, 1:] * 4, 0.01**2, rtol=1e-9)


def test_another_scale_moves_the_calm_and_leaves_the_jump():
    movement = latent.calm(50, 4, np.full(3, 0.01))
    moved, variance = np.zeros((50, 4, 3)), np.full((50, 4, 3), 0.01**2 / 4)
    moved[20, :, 0] = 1.0
    after = latent.updated(movement, moved, variance).rescaled(np.array([0.03, 0.01, 0.01]))
    np.testing.assert_allclose(np.delete(after.variances[:, 0], 20) * 4, 0.03**2, rtol=1e-9)
    assert after.variances[20, 0] == pytest.approx(
        latent.updated(movement, moved, variance).variances[20, 0], rel=0.01
    )


# Readings of a converter


def test_a_plunger_at_rest_between_two_codes():
    """Gaussian rounding is off by many standard errors there, the expansion is not."""
    step, sigma, true = 1.0, 0.25, 0.25
    rng = np.random.default_rng(6)
    codes = np.rint((true + sigma * rng.standard_normal((4000, 3))) / step) * step
    sd, at = (np.full(3, sigma), np.full(3, step)), codes.mean(axis=0)
    plain_error = np.abs(at - true)
    for _ in range(20):
        reading, variance = quantised.expanded(codes, np.broadcast_to(at, codes.shape), *sd)
        at = np.average(reading, axis=0, weights=1.0 / variance)
    standard_error = np.sqrt(1.0 / np.sum(1.0 / variance, axis=0))
    assert np.all(np.abs(at - true) < 4.0 * standard_error)
    assert np.all(plain_error > 8.0 * standard_error)


def test_a_fine_converter_stays_gaussian():
    codes = np.random.default_rng(7).standard_normal((10, 3))
    reading, variance = quantised.expanded(codes, codes * 0.0, np.ones(3), np.full(3, 0.2))
    np.testing.assert_array_equal(reading, codes)
    np.testing.assert_allclose(variance, 1.0 + 0.2**2 / 12.0)


# Mixtures


def test_quantiles_of_a_mixture_are_within_a_hundredth_of_its_sd():
    rng = np.random.default_rng(8)
    mean = rng.standard_normal((64, 5)) * np.array([0.0, 0.1, 1.0, 2.0, 3.0])
    variance = np.exp(rng.uniform(-1, 1, (64, 5)))
    mixture = Mixture()
    for first in range(0, 64, 8):
        mixture.add(mean[first : first + 8], variance[first : first + 8], 1.0 / 64)
    found = mixture.quantiles()
    for time in range(5):
        sd = np.sqrt(variance[:, time].mean() + mean[:, time].var())
        share = norm.cdf(found[:, time][:, None], mean[:, time], np.sqrt(variance[:, time]))
        density = norm.pdf(found[:, time][:, None], mean[:, time], np.sqrt(variance[:, time]))
        error = (share.mean(axis=1) - LEVELS) / density.mean(axis=1)
        assert np.abs(error).max() < 0.01 * sd


def test_quantiles_of_mixtures_that_lie_apart_are_those_of_all_of_it():
    """70 sds apart, weights 0.7 and 0.3; one grid for both would end between them."""
    rng = np.random.default_rng(10)
    places, weights = (0.0, 70.0), (0.7, 0.3)
    mean = [rng.standard_normal((64, 1)) + place for place in places]
    mixtures = [Mixture(), Mixture()]
    for one, values, weight in zip(mixtures, mean, weights, strict=True):
        one.add(values, np.ones((64, 1)), weight / 64)
    found = quantiles(mixtures)[:, 0]
    each = np.concatenate(mean)[:, 0]
    share = np.repeat(np.array(weights) / 64, 64)
    reached = norm.cdf(found[:, None], each).dot(share)
    density = norm.pdf(found[:, None], each).dot(share)
    assert np.abs((reached - LEVELS) / density).max() < 0.02


def test_a_mixture_takes_no_more_room_for_more_draws():
    mixture = Mixture()
    sizes = set()
    for _ in range(3):
        mixture.add(np.zeros((8, 100)), np.ones((8, 100)))
        sizes.add(mixture.below.nbytes)
    assert len(sizes) == 1


def test_running_moments_are_those_of_all_rows():
    rows, weights = np.random.default_rng(9).standard_normal((20, 4)), np.arange(1.0, 21.0)
    moments = Moments()
    for row, weight in zip(rows, weights, strict=True):
        moments.add(row[None], weight)
    mean = np.average(rows, axis=0, weights=weights)
    np.testing.assert_allclose(moments.mean, mean)
    np.testing.assert_allclose(moments.variance, np.average((rows - mean) ** 2, 0, weights))


# States on disk


def test_states_come_back_from_disk_as_they_were(tmp_path):
    rng = np.random.default_rng(3)
    shapes = ((4, 10, 3), (4, 10, 10), (4, 10), (4,))
    kept = [Filtered(*(jnp.asarray(rng.standard_normal(s)) for s in shapes)) for _ in range(3)]
    states = States(tmp_path)
    for one in kept:
        states.append(one)
    for number in (2, 0, 1):
        for found, one in zip(states[number], kept[number], strict=True):
            np.testing.assert_array_equal(found, one)
    assert not list(tmp_path.iterdir()), "the file has a name that outlives the process"
    states.close()


# Budget

NOWHERE = jumps(np.arange(4), np.zeros(1, dtype=bool), 4)
"""No interval in which a load jumped."""


def test_the_numbers_of_the_budget_on_a_path_known_by_hand():
    time = np.arange(0.0, 10.0, 0.0025)
    load = np.where(time < 8.0, 1e4 * time, 0.0)[None]
    displacement = (0.008 * time)[None]
    tally = budget.Tally(budget.windows(time, load[0]))
    tally.add(time, load, displacement, jumped=NOWHERE, first=0)
    found = tally.figures()[0]
    peak = 1e4 * (8.0 - 0.0025)
    np.testing.assert_allclose(found[:2], peak, rtol=1e-9)
    assert found[2] == pytest.approx(0.5 * 8.0 * 8e4, rel=1e-3)
    assert found[3] == pytest.approx(0.008 * 8.0, rel=1e-3)
    assert found[4] == pytest.approx(1e4 / 0.008, rel=1e-9)


@pytest.mark.parametrize("cuts", [(1500,), (2600, 3100), (400, 2990, 2991)])
def test_the_budget_of_stretches_is_that_of_the_whole(cuts):
    """Cuts in the rise, in the failure, and about the peak; equal peaks lie in two stretches."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 10.0, 0.0025)
    load = np.where(time < 7.5, 1e4 * time, 0.0) + 30.0 * rng.standard_normal((3, 4000))
    load[2, [100, 3500]] = 9e4
    displacement = 0.1 + 0.0008 * time + 1e-5 * rng.standard_normal((3, 4000))
    at = budget.windows(time, np.where(time < 7.5, 1e4 * time, 0.0))
    whole, parts = budget.Tally(at), budget.Tally(at)
    whole.add(time, load, displacement, jumped=NOWHERE, first=0)
    ends = [0, *cuts, 4000]
    for first, last in list(pairwise(ends))[::-1]:
        here = slice(first, last)
        parts.add(time[here], load[:, here], displacement[:, here], jumped=NOWHERE, first=first)
    np.testing.assert_allclose(parts.figures(), whole.figures(), rtol=1e-8)
    rise = at.rise
    slope = [np.polyfit(x[rise], f[rise], 1)[0] for x, f in zip(displacement, load, strict=True)]
    np.testing.assert_allclose(whole.figures()[:, 4], slope, rtol=1e-6)


def test_a_load_that_jumped_did_so_at_one_instant_and_kept_its_impulse():
    """A load that rises by 4 a sample falls by 50 two steps after sample 3, of four steps each.

    A path that goes up and down between samples 3 and 4 with the same impulse jumps at the same
    step; of calm intervals nothing is changed.
    """
    steps, samples = 4, 8
    rows = np.arange((samples - 1) * steps + 1)
    truth = 1.0 * rows + 100.0
    truth[rows > 14] -= 50.0
    jumped = np.arange(samples) == 3
    where = jumps(rows, jumped, steps)
    assert [each.tolist() for each in where] == [[12], [16], [8]]
    drawn = np.tile(truth, (2, 1))
    drawn[0, 13:16] += [300.0, -180.0, -120.0]  # the same impulse
    moved = np.tile(0.5 * rows, (2, 1))
    found, places = at_once(drawn, moved + 9.0 * (rows > 12), where)
    np.testing.assert_allclose(found, [truth, truth], atol=4.0)  # what it rises in an interval
    assert found.max() < truth.max() + 1.0 < drawn.max() - 200.0
    np.testing.assert_array_equal((places - moved)[0, 11:18], [0, 0, 0, 0, 9, 9, 9])
    again, _ = at_once(drawn[:, 5:], moved[:, 5:], where.within(slice(5, len(rows))))
    np.testing.assert_array_equal(again, found[:, 5:])
    elsewhere = jumps(rows, np.zeros(samples, dtype=bool), steps)
    np.testing.assert_array_equal(at_once(drawn, moved, elsewhere)[0], drawn)


def test_noise_is_told_within_a_law():
    """Errors are laid over each law's own mean: what lies between laws is model form, not noise.

    Of two laws with sds 1 and 3 and probabilities 0.8 and 0.2, both of 2000 draws, the pooled
    variance is 0.8 + 0.2 * 9 = 2.6; its sd is known to 1 / sqrt(2 * 2000 / 1.9) = 2 %.
    """
    rng = np.random.default_rng(6)
    first, second = rng.standard_normal((2000, 5)), 500.0 + 3.0 * rng.standard_normal((2000, 5))
    found = _within([first, second], [0.8 / 2000, 0.2 / 2000])
    np.testing.assert_allclose(found, np.sqrt(2.6), rtol=0.08)
    assert _within([first[:1], second[:1]], [0.8, 0.2]) is None


SDS = np.arange(5.0)


def test_model_form_is_the_spread_between_laws():
    values = np.tile(np.array([[1.0], [1.0], [3.0], [3.0]]), (1, 5))
    listed = budget.lines("A", (values, np.ones(4)), (SDS, None, None, SDS), np.array([0, 0, 1, 1]))
    assert listed[0].parts[3] == pytest.approx(1.0)
    assert listed[0].parts[1] is None
    assert [line.parts[4] for line in listed] == list(SDS)
    one = budget.lines("A", (values, np.ones(4)), (None,) * 4, np.zeros(4))
    assert one[0].parts[3] is None
