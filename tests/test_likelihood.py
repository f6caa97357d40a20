"""Log-likelihood of small problems: sums, weights, gradient, one program for all values."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, frame_problem, release_problem
from scipy import stats
from test_staggered import DRY

from rigid.likelihood.channels import Piece, SensorSheet
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.marginal import BLOCK, marginal_likelihood
from rigid.likelihood.noise import marginal, quadratic
from rigid.likelihood.problem import log_density, log_posterior
from rigid.likelihood.quantisation import interval


@pytest.fixture(scope="module")
def frame():
    return frame_problem()


@pytest.fixture(scope="module")
def rubbing():
    name = "coulomb-friction"
    return frame_problem(names=(*BASE, name), known=DRY[name])


@pytest.fixture(scope="module")
def release():
    return release_problem({"k_LC": 6e7, "mu": 2e4})


def made_pieces(rng, samples: int, parts: tuple[int, ...]) -> tuple[tuple[Piece, ...], list]:
    """Load of one sensor, cut into several records; predictions of three walkers."""
    sheet = SHEETS["load"]
    true = np.linspace(0, 2e5, samples)[:, None] * np.array([1.0, 1.001, 0.98])
    noisy = true[:, 0] * 1.0008 + 60.0 + sheet.noise * rng.standard_normal(samples)
    data = np.round(noisy / sheet.step) * sheet.step
    pieces, predictions, at = [], [], 0
    for number, n in enumerate(parts):
        here = slice(at, at + n)
        pieces.append(Piece(number, "load", sheet, (0,), ("A",), data[here, None], np.ones((n, 1))))
        predictions.append({"load": jnp.asarray(true[here, None])})
        at += n
    return tuple(pieces), predictions


VALUES = {"noise[load,A]": jnp.asarray([140.0, 147.5, 160.0])}


def test_a_sensor_is_the_same_in_every_record():
    """Cut into records or not, the samples of a sensor have one gain and one zero."""
    n = 3 * BLOCK + 17
    whole = marginal_likelihood(*made_pieces(np.random.default_rng(51), n, (n,)), VALUES)
    parts = marginal_likelihood(
        *made_pieces(np.random.default_rng(51), n, (50, BLOCK, n - 50 - BLOCK)), VALUES
    )
    np.testing.assert_allclose(parts.value, whole.value, rtol=1e-11)
    np.testing.assert_allclose(parts.sensors["load,A"].best.gain, whole.sensors["load,A"].best.gain)
    assert set(parts.tracks) == {(0, 0), (1, 0), (2, 0)}
    np.testing.assert_allclose(sum(parts.tracks.values()), whole.tracks[0, 0], rtol=1e-11)
    found = whole.sensors["load,A"]
    assert abs(float(found.best.gain[0]) - 0.0008) < 4 * float(found.var_gain[0]) ** 0.5


def test_samples_without_weight_do_not_count():
    n = 200
    pieces, predictions = made_pieces(np.random.default_rng(52), n, (n,))
    weight = np.ones((n, 1))
    weight[37:61] = 0.0
    spoilt = np.where(weight > 0, pieces[0].data, 1e9)
    one = eqx.tree_at(
        lambda p: (p.data, p.weight), pieces[0], (jnp.asarray(spoilt), jnp.asarray(weight))
    )
    got = marginal_likelihood((one,), predictions, VALUES)
    kept = weight[:, 0] > 0
    sheet = SHEETS["load"]
    less = Piece(0, "load", sheet, (0,), ("A",), spoilt[kept], np.ones((kept.sum(), 1)))
    expected = marginal_likelihood((less,), [{"load": predictions[0]["load"][kept]}], VALUES)
    np.testing.assert_allclose(got.value, expected.value, rtol=1e-11)


def test_value_is_the_sum_over_samples():
    n = 2 * BLOCK + 5
    pieces, predictions = made_pieces(np.random.default_rng(53), n, (n,))
    got = marginal_likelihood(pieces, predictions, VALUES)
    sheet, best = SHEETS["load"], got.sensors["load,A"].best
    law = sheet.noise_model(VALUES["noise[load,A]"])
    column = pieces[0].data
    again = quadratic(
        law, best.gain, best.zero, column, jnp.ones((n, 1)), predictions[0]["load"][:, 0]
    )
    # Expanded around its own maximum it is the same integral, but for Newton's last step.
    np.testing.assert_allclose(got.value, marginal(again, best, sheet.spread).value, atol=1e-4)


@pytest.mark.parametrize("sigma_steps", [0.1, 0.15, 0.22])
def test_noise_small_against_the_step_is_no_better_for_it(sigma_steps: float):
    """A load that hardly moves, read as two codes: few samples tell the zero, and not by a mean.

    An expansion where least squares ends promised hundreds of nats for a noise of half of the true
    one, and a search went to and fro between the two.
    """
    rng, n, step = np.random.default_rng(57), 1500, 295.0
    sheet = SensorSheet(step=step, noise=step / 2, gain_sd=0.0, zero_sd=100.0)
    true = 20.0 * np.sin(np.linspace(0.0, 6.0, n))
    read = true + 60.0 + 0.22 * step * rng.standard_normal(n)
    data = np.round(read / step) * step
    piece = Piece(0, "load", sheet, (0,), ("A",), data[:, None], np.ones((n, 1)))
    sigma = sigma_steps * step
    found = marginal_likelihood(
        (piece,),
        [{"load": jnp.asarray(true)[:, None, None]}],
        {"noise[load,A]": jnp.array([sigma])},
    )
    zeros = np.linspace(0.0, 200.0, 2001)
    r = jnp.asarray((data - true)[:, None] - zeros)
    values = np.asarray(interval(r, jnp.asarray(sigma), step).value).sum(axis=0)
    logs = values + stats.norm.logpdf(zeros, 0.0, sheet.zero_sd)
    exact = logs.max() + np.log(np.exp(logs - logs.max()).sum() * (zeros[1] - zeros[0]))
    # The curve through `interval` is wrong by up to 1e-3 a sample where noise is that small.
    assert float(found.value[0]) == pytest.approx(exact, abs=0.1 if sigma_steps > 0.1 else 0.5)
    assert float(found.sensors["load,A"].best.zero[0]) == pytest.approx(
        zeros[logs.argmax()], abs=0.2 * float(found.sensors["load,A"].var_zero[0]) ** 0.5 + 0.1
    )


def test_readings_of_a_solve_that_blew_up_are_never_probable(monkeypatch):
    """Steps of a rig of next to no friction read 1e70 N, and that once was worth e^(1e43)."""
    rng, n = np.random.default_rng(55), 2 * BLOCK
    pieces, predictions = made_pieces(rng, n, (n,))
    size = 10.0 ** np.linspace(0.0, 120.0, 241)
    wild = predictions[0]["load"][..., :1] * size * rng.standard_normal((n, 1, 1))
    sigma = {"noise[load,A]": jnp.full(len(size), 147.5)}

    def value():
        return np.asarray(marginal_likelihood(pieces, [{"load": wild}], sigma).value)

    assert np.all(value()[size > 1e8] == -np.inf)
    assert np.all(np.isfinite(value()[size < 1e4]))
    assert np.all(value() < 0.0)
    monkeypatch.setattr("rigid.likelihood.marginal.FAR", np.inf)
    assert not np.all(value()[size > 1e8] == -np.inf)


def test_halves_of_the_weight_count_half():
    n = 100
    pieces, predictions = made_pieces(np.random.default_rng(54), n, (n,))
    half = eqx.tree_at(lambda p: p.weight, pieces[0], 0.5 * pieces[0].weight)
    full, tempered = (
        marginal_likelihood((p,), predictions, VALUES).sensors["load,A"] for p in (*pieces, half)
    )
    ratio = np.asarray(tempered.var_zero / full.var_zero)
    assert np.all(ratio > 1.0)
    assert np.all(ratio < 2.0)  # the prior's share does not change


@pytest.mark.slow
@pytest.mark.parametrize("which", ["frame", "rubbing", "release"])
def test_derivatives_are_those_of_differences(which: str, request):
    """Gains and zeros move with the parameters, and the determinant of the marginal with them."""
    problem = request.getfixturevalue(which)
    size = problem.parameters.size
    rng = np.random.default_rng(55)
    away, along = 0.2 * rng.standard_normal(size), rng.standard_normal(size)
    along /= np.linalg.norm(along)

    @eqx.filter_jit
    def slopes(problem, z):
        def ahead(step):
            return problem.log_posterior((z + step * along)[None])[0]

        def slope(step):
            return jax.jvp(ahead, (step,), (1.0,))[1]

        gradient = jax.grad(lambda z: problem.log_posterior(z[None])[0])(z)
        return gradient, jax.jvp(slope, (0.0,), (1.0,))[1]

    def value(z):
        return np.asarray(log_posterior(problem, jnp.asarray(z)))

    h, wide = 1e-5, 1e-3
    # At the truth the slopes are a thousandth of those away from it, and so are their errors: the
    # last step to the top leaves up to CLOSE nats of third order.
    for z, exactly in ((away, 1e-4), (np.zeros(size), 5e-3)):
        gradient, bend = map(np.asarray, slopes(problem, jnp.asarray(z)))
        assert np.all(np.isfinite(gradient))
        ends = value(np.concatenate([z + h * np.eye(size), z - h * np.eye(size)]))
        # Rounding 1e-16 of values of 1e5 to 1e7 over h, truncation h^2 of third derivatives.
        rounding = 1e-13 * np.abs(ends).max()
        difference = (ends[:size] - ends[size:]) / (2 * h)
        small = rounding / h + 1e-6 * np.abs(difference).max() + 1e-3
        np.testing.assert_allclose(gradient, difference, rtol=exactly, atol=small)
        before, here, after = value(z + wide * np.array([-1.0, 0.0, 1.0])[:, None] * along)
        differences = (before - 2.0 * here + after) / wide**2
        np.testing.assert_allclose(bend, differences, rtol=1e-3, atol=4 * rounding / wide**2)


@pytest.mark.slow
def test_one_program_serves_all_values_and_all_data_of_a_shape(frame):
    compiled = []

    @eqx.filter_jit
    def counted(problem, z):
        compiled.append(1)  # runs when the program is traced, and only then
        return problem.log_posterior(z)

    size = frame.parameters.size
    other = frame_problem(seed=1)
    third = other.with_weights(
        {(p.group, p.quantity): 0.5 * np.asarray(p.weight) for p in other.pieces}
    )
    values = [
        counted(problem, jnp.full((2, size), shift))
        for problem in (frame, other, third)
        for shift in (0.0, 0.1, -0.3)
    ]
    assert len(compiled) == 1
    assert len({float(v[0]) for v in values}) == len(values)


def test_log_density_takes_any_number_of_rows_with_one_program(frame, monkeypatch):
    shapes = []

    def seen(problem, z):
        shapes.append(z.shape)
        return -0.5 * (z * z).sum(axis=1)

    monkeypatch.setattr("rigid.likelihood.problem.log_posterior", seen)
    z = np.random.default_rng(56).standard_normal((75, frame.parameters.size))
    np.testing.assert_allclose(log_density(frame, z), -0.5 * (z * z).sum(axis=1))
    assert len(set(shapes)) == 1


@pytest.mark.slow
def test_where_the_model_fails_the_density_is_zero(frame):
    z = jnp.zeros((2, frame.parameters.size)).at[1, 0].set(jnp.nan)
    value = log_posterior(frame, z)
    assert np.isfinite(value[0])
    assert value[1] == -np.inf


def test_sensors_are_listed_once(frame, release):
    assert frame.sensors == tuple(f"{q},A" for q in SlowGroup.quantities)
    assert release.sensors == ("acceleration,A",)
