"""The package as a library: one object per spec, the same numbers as the commands."""

import os
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cart import DRAG, MASS, SPEC, write_cart
from scipy.stats import norm

import rigid
from rigid.inference.convergence import r_hat
from rigid.inference.posterior import load_posterior, unstack
from rigid.io import cli
from rigid.likelihood.assemble import assemble
from rigid.likelihood.problem import log_density, log_posterior, walkers
from rigid.records.read import read_records
from rigid.spec import load_spec

ROOT = Path(rigid.__file__).parents[1]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_cart(tmp_path_factory.mktemp("cart"))


@pytest.fixture(scope="module")
def study(path):
    return rigid.load(path)


@pytest.fixture(scope="module")
def z(study):
    rng = np.random.default_rng(2)
    return rng.standard_normal((walkers(study.problem) // 2, len(study.names)))


def run(program, **env):
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | env,
        check=False,
        timeout=300,
    )


def test_every_name_is_there_and_documented():
    assert len(rigid.__all__) >= 8
    for name in rigid.__all__:
        assert getattr(rigid, name).__doc__.strip()
    assert set(rigid.__all__) <= set(dir(rigid))
    with pytest.raises(AttributeError, match="no attribute 'lod'"):
        _ = rigid.lod


def test_the_density_is_that_of_the_command_to_the_bit(study, path, z):
    spec = load_spec(path)
    problem = assemble(spec, read_records(spec))
    assert study.names == problem.parameters.labels
    expected = np.asarray(log_posterior(problem, jnp.asarray(z)))
    assert np.all(np.isfinite(expected))
    np.testing.assert_array_equal(np.asarray(study.log_posterior(z)), expected)
    np.testing.assert_array_equal(log_density(problem, z), expected)


def test_the_density_maps_compiles_and_has_gradients(study, z):
    density = study.log_posterior
    rows = jnp.asarray(z)
    expected = np.asarray(density(rows))
    one = float(density(rows[0]))
    # Batches of other sizes differ in the order of sums alone: 2,000 samples of 1e-16 each.
    np.testing.assert_allclose(one, expected[0], rtol=1e-12)
    np.testing.assert_allclose(jax.vmap(density)(rows), expected, rtol=1e-12)
    np.testing.assert_allclose(jax.jit(density)(rows[0]), one, rtol=1e-12)
    prior = -0.5 * np.sum(z**2, axis=1) - 0.5 * density.size * np.log(2 * np.pi)
    np.testing.assert_allclose(density.log_likelihood(rows), expected - prior, rtol=1e-12)
    slope = np.asarray(jax.grad(density)(rows[0]))
    h = 1e-5  # error h^2 of a third derivative that is of the size of the slope
    for i in range(density.size):
        step = jnp.zeros(density.size).at[i].set(h)
        numeric = (float(density(rows[0] + step)) - float(density(rows[0] - step))) / (2 * h)
        assert slope[i] == pytest.approx(numeric, rel=1e-5, abs=1e-4 * abs(slope).max())
    with pytest.raises(ValueError, match=r"must be \(3,\) or \(n, 3\)"):
        density(jnp.zeros(2))


def test_values_are_those_of_the_prior_laws(study):
    found = study.log_posterior.values(jnp.zeros(len(study.names)))
    assert float(found["M_Pl"]) == pytest.approx(30.0, rel=1e-12)
    assert found["mu"].shape == ()
    assert study.log_posterior.values(jnp.zeros((4, len(study.names))))["mu"].shape == (4,)
    assert study.units["mu"] == "N s/m"


def test_readings_are_linear_in_mass_and_drag(study):
    place = "to-and-fro,A"
    read = study.simulate({"M_Pl": 40.0, "mu": 0.0})[place]["force"]
    twice = study.simulate({"M_Pl": 80.0, "mu": 0.0})[place]["force"]
    assert read.shape == study.times[place].shape
    np.testing.assert_allclose(twice, 2.0 * read, rtol=1e-9)
    skewed = study.simulate({"M_Pl": 40.0, "mu": 0.0, "gain[force,A]": 0.5, "zero[force,A]": 3.0})
    np.testing.assert_allclose(skewed[place]["force"], 1.5 * read + 3.0, rtol=1e-9)

    def largest(mass):
        return jnp.max(study.simulate({"M_Pl": mass, "mu": 0.0})[place]["force"])

    slope = jax.jit(jax.grad(largest))(40.0)
    assert float(slope) == pytest.approx(float(largest(40.0)) / 40.0, rel=1e-9)
    both = jax.vmap(largest)(jnp.array([40.0, 80.0]))
    np.testing.assert_allclose(both, [read.max(), twice.max()], rtol=1e-9)
    with pytest.raises(rigid.InputError, match="simulate: unknown name 'M_pl'; did you mean"):
        study.simulate({"M_pl": 1.0})


def test_noise_is_drawn_on_request(study):
    place = "to-and-fro,A"
    key = jax.random.key(0)
    ideal = study.simulate({})[place]["force"]
    noisy = study.simulate({"noise[force,A]": 4.0}, key)[place]["force"]
    n = len(ideal)
    assert float(jnp.std(noisy - ideal)) == pytest.approx(4.0, rel=4.0 / np.sqrt(2 * n))
    again = study.simulate({"noise[force,A]": 4.0}, key)[place]["force"]
    np.testing.assert_array_equal(noisy, again)


def test_thirty_two_bits_are_refused(study, path):
    with jax.enable_x64(False), pytest.raises(rigid.EnvironmentFaultError, match="in 32 bits"):
        study.log_posterior(np.zeros(3))
    steps = f"""
from pathlib import Path
from rigid.spec import load_spec
from rigid.records.read import read_records
from rigid.likelihood.assemble import assemble
spec = load_spec(Path({str(path)!r}))
assemble(spec, read_records(spec))
"""
    done = run(steps)
    assert "JAX computes in 32 bits here" in done.stderr.splitlines()[-1]
    held = run("import rigid; rigid.load", JAX_ENABLE_X64="0")
    assert "JAX_ENABLE_X64 holds JAX to 32 bits" in held.stderr.splitlines()[-1]


@pytest.mark.slow
def test_a_session_that_ran_in_32_bits_goes_on_in_64(path):
    program = f"""
import jax, jax.numpy as jnp
assert jnp.ones(3).dtype == jnp.float32
import rigid
study = rigid.load({str(path)!r})
print(study.log_posterior(jnp.zeros(len(study.names))).dtype)
"""
    done = run(program)
    assert (done.returncode, done.stdout) == (0, "float64\n"), done.stderr


def test_a_command_runs_outside_the_main_thread(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["rigid.test", "some-spec", "--quiet"])
    found = []
    thread = threading.Thread(target=lambda: found.append(cli.run("test", "Tests.", lambda _: 0)))
    thread.start()
    thread.join()
    assert found == [0]


@pytest.fixture(scope="module")
def fit(study):
    return study.fit(quiet=True)


def test_a_fit_finds_mass_and_drag(fit):
    table = fit.summary()
    assert table.index.name == "name"
    for name, truth in (("M_Pl", MASS), ("mu", DRAG)):
        assert abs(table.loc[name, "mean"] - truth) < 4.0 * table.loc[name, "sd"]
    assert {check.name for check in fit.checks} >= {"converged", "starts", "residuals"}
    assert fit.best.shape == (3,)


def test_its_figures_can_be_had(fit):
    figure = fit.plot.record("to-and-fro")
    assert figure.axes
    assert fit.plot.corner().axes
    assert fit.plot.traces().axes
    with pytest.raises(LookupError, match="no roots"):
        fit.plot.roots()
    with pytest.raises(KeyError, match="there are to-and-fro,A"):
        fit.plot.record("elsewhere")


def test_its_posterior_is_the_file(fit, tmp_path):
    fit.write(tmp_path)
    read = load_posterior(tmp_path / "posterior.nc")
    assert set(read.children) == set(fit.posterior.children)
    for name, group in fit.posterior.children.items():
        for variable, values in group.to_dataset().data_vars.items():
            np.testing.assert_array_equal(read[name][variable].values, values.values)
            assert read[name][variable].attrs == values.attrs
    assert {"index.html", "summary.csv", "result.json"} <= {p.name for p in tmp_path.iterdir()}
    assert np.isfinite(np.asarray(az.ess(fit.posterior["posterior"]["mu"].values)))


@pytest.mark.slow
def test_a_missing_effect_is_found_and_the_study_with_it_given(tmp_path):
    path = write_cart(tmp_path)
    text = SPEC.replace(
        'effects = ["viscous-friction"]',
        'effects = ["viscous-friction"]\ncandidates = ["coulomb-friction"]',
    ).replace("[sensors]", "F_C = { lognormal = { median = 10.0, factor = 4.0 } }\n\n[sensors]")
    path.write_text(text, "utf-8")
    table = np.loadtxt(tmp_path / "cart.csv", delimiter=",", skiprows=1)
    table[:, 2] += 20.0 * np.sign(np.cos(np.pi * table[:, 0]))  # the sign of its velocity
    rows = [",".join(f"{v:.9g}" for v in row) for row in table]
    (tmp_path / "cart.csv").write_text("\n".join(["t,x,F", *rows]) + "\n", "utf-8")
    before = sorted(tmp_path.iterdir())
    found = rigid.load(path).discover(quiet=True)
    assert found.verdict == "named"
    (step,) = found.steps
    assert (step["effect"], step["spec"]) == ("coulomb-friction", None)
    assert "1. coulomb-friction" in found.table()
    assert "F_C" in found.extended.names
    assert found.extended.spec.model.effects == ("viscous-friction", "coulomb-friction")
    assert sorted(tmp_path.iterdir()) == before
    laws = rigid.load(path).laws(tmp_path / "out", quiet=True)
    assert (tmp_path / "out" / "laws.json").read_text("utf-8") == laws.json()
    assert laws.result["verdict"] in laws.table()


def test_bands_are_a_data_set_with_units(tmp_path, monkeypatch):
    import test_bands as hand

    hand.write_record(tmp_path / "press.csv")
    hand.write_posterior(tmp_path / "posterior.nc")
    (tmp_path / "field.toml").write_text(hand.spec_text(), "utf-8")
    known = hand.known_by_hand(hand.ZEROS, hand.ZEROS)[1]
    monkeypatch.setattr("rigid.smoothing.run.learned", lambda *_: (known,))
    monkeypatch.setattr("rigid.smoothing.run.bands", lambda *_: hand.bands_by_hand("press"))
    study = rigid.load(tmp_path / "field.toml")
    found = study.bands(quiet=True)
    expected = hand.bands_by_hand("press")
    assert found.sizes["time"] == len(expected.time)
    for name, band in expected.bands.items():
        np.testing.assert_array_equal(found[name].values, band.quantiles)
        np.testing.assert_array_equal(found[f"{name}_parts"].values, band.parts)
    assert (found["load_B"].attrs["units"], found["time"].attrs["units"]) == ("N", "s")
    assert (found.attrs["record"], found.attrs["simulated"]) == ("press", 1)
    np.testing.assert_array_equal(found["quantile"], [0.05, 0.25, 0.5, 0.75, 0.95])

    posterior = load_posterior(tmp_path / "posterior.nc")
    (tmp_path / "posterior.nc").unlink()
    same = study.bands(posterior, quiet=True)
    np.testing.assert_array_equal(same["load_B"], found["load_B"])
    with pytest.raises(rigid.InputError, match=r"bands\(record=...\) takes press"):
        study.bands(posterior, "prss", quiet=True)


def test_the_file_tells_what_the_tables_say_of_convergence(fit):
    stats = fit.posterior["sample_stats"].to_dataset()
    table = fit.summary()
    for name in ("r_hat", "ess_bulk", "ess_tail"):
        np.testing.assert_array_equal(stats[name].values, table[name].to_numpy(float))
    assert list(stats["parameter"].values) == list(table.index)


def test_chains_of_ensembles_give_the_r_hat_between_them(fit):
    group = fit.posterior["posterior"].to_dataset()
    chains = rigid.by_ensemble(group)
    kept = fit.calibrated.kept_shape
    assert chains["mu"].shape == (2, kept[0] * kept[1] // 2)
    steps = unstack(group["mu"].values, 2)
    np.testing.assert_allclose(az.rhat(chains["mu"].values), r_hat(steps), rtol=1e-12)
    assert chains["mu"].attrs["units"] == "N s/m"


def test_blocks_hold_the_likelihood_of_all_samples(fit, study):
    group = fit.posterior["log_likelihood"].to_dataset()
    assert set(group["block_channel"].values) == {"to-and-fro,A"}
    assert np.all(np.diff(group["block_begins"].values) > 0.0)
    sums = group["block_log_likelihood"].astype(float).sum("block")
    (piece,) = fit.calibrated.problem.pieces
    weight = np.asarray(piece.weight)[:, 0]
    draws = fit.posterior["posterior"].to_dataset().squeeze(("quantity", "cylinder"))
    for chain, draw in ((0, 0), (3, 1), (20, 2)):
        one = draws.isel(chain=chain, draw=draw)
        given = {name: float(one[name]) for name in ("M_Pl", "mu")}
        given |= {f"{name}[force,A]": float(one[name]) for name in ("gain", "zero")}
        apart = piece.data[:, 0] - study.simulate(given)["to-and-fro,A"]["force"]
        terms = norm.logpdf(np.asarray(apart), scale=float(one["noise"]))
        # Kept in 32 bits: a part in 2^24 of each block.
        assert float(sums[chain, draw]) == pytest.approx(weight @ terms, rel=1e-6)


def test_arviz_takes_the_file(fit, tmp_path):
    fit.write(tmp_path)
    data = az.from_netcdf(tmp_path / "posterior.nc")
    table = az.summary(data, var_names=["M_Pl", "mu"], kind="stats")
    assert table.loc["mu", "mean"] == pytest.approx(fit.summary().loc["mu", "mean"], rel=0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of few blocks
        left_out = az.loo(data, var_name="block_log_likelihood")
    assert left_out.n_data_points == data["log_likelihood"]["block_log_likelihood"].sizes["block"]
