"""mu(omega) of draws, and the views of the rig that have their own."""

import jax.numpy as jnp
import numpy as np
from rigs import BASE, MEMORY, NOMINAL, effects, parameter, release_problem

from rigid.inference.friction_curve import FREQUENCIES, friction, scopes
from rigid.likelihood.parameters import collect
from rigid.likelihood.priors import Lognormal
from rigid.likelihood.problem import Problem

DRAWS = {k: np.full(3, v) for k, v in NOMINAL.items()} | {"mu": np.array([1e4, 1e5, 1e6])}


def test_friction_is_the_sum_of_dashpot_and_branches():
    found = friction(effects(), DRAWS, ())
    omega = 2 * np.pi * FREQUENCIES
    branches = 5e5 / (1 + 0.2j * omega) + 1e5 / (1 + 8e-3j * omega)
    mu = DRAWS["mu"][:, None] + branches
    np.testing.assert_allclose(found.dissipative, mu.real, rtol=1e-12)
    np.testing.assert_allclose(found.storage, -omega * mu.imag, rtol=1e-12)
    np.testing.assert_allclose(found.magnitude, np.abs(mu), rtol=1e-12)


def test_friction_obeys_thermodynamics():
    """It dissipates at every frequency, stores, and falls from mu + sum mu_i to mu."""
    found = friction(effects(), DRAWS, ())
    assert np.all(found.dissipative > 0)
    assert np.all(found.storage >= 0)
    assert np.all(np.diff(found.magnitude, axis=1) < 0)
    np.testing.assert_allclose(found.magnitude[:, 0], DRAWS["mu"] + 6e5, rtol=1e-3)
    np.testing.assert_allclose(found.magnitude[:, -1], DRAWS["mu"], rtol=0.05)


def test_constant_friction_stores_nothing():
    found = friction(effects(BASE), DRAWS, ())
    np.testing.assert_array_equal(found.storage, 0.0)
    np.testing.assert_allclose(
        found.dissipative, np.broadcast_to(DRAWS["mu"][:, None], found.dissipative.shape)
    )


def test_eighty_hertz_is_near_a_frequency_shown():
    assert np.abs(FREQUENCIES / 80.0 - 1.0).min() < 0.02


def test_scopes_are_those_that_a_parameter_varies_by():
    base = release_problem({}, samples=64)
    assert scopes(base) == {"": ()}
    law = Lognormal(1e5, 10.0)
    varied = [parameter(f"mu[{kind}]", law) for kind in ("release", "frame")]
    listed = collect([*base.parameters.known, *varied])
    problem = Problem(base.effects, listed, base.groups, base.pieces)
    assert scopes(problem) == {"frame": ("frame",), "release": ("release",)}


def test_records_see_the_friction_of_their_scope():
    values = {k: jnp.asarray(v) for k, v in DRAWS.items() if k != "mu"}
    values |= {"mu[frame]": jnp.full(3, 2e5), "mu[release]": jnp.full(3, 3e4)}
    zero = {"mu_branch[1]": jnp.zeros(3), "mu_branch[2]": jnp.zeros(3)}
    for scope, expected in (("frame", 2e5), ("release", 3e4)):
        found = friction(effects(MEMORY), values | zero, (scope,))
        np.testing.assert_allclose(found.magnitude, expected, rtol=1e-12)
