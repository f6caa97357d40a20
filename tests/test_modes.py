"""A release alone, far noisier than the sensor: two modes, in proportion as on a fine grid."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, effects, parameters, problem, track

from rigid.inference import convergence
from rigid.inference.calibrate import DOF, propose
from rigid.inference.coordinates import chart_of
from rigid.inference.proposal import MixtureProposal
from rigid.inference.sample import Settings, sample
from rigid.inference.search import Found, search
from rigid.likelihood.groups import ReleaseGroup
from rigid.likelihood.priors import Fixed, LogUniform
from rigid.likelihood.problem import Problem, log_density, log_posterior

NOISE = 15.0
"""m/s^2: at 0.1 the wrong optimum is worse by thousands in log-posterior, here by a fraction."""
BETWEEN = 45e6
"""N/m: no posterior to speak of between the modes at 36 and 60 MN/m."""
POINTS = 401
REACH = 4.0

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def release() -> Problem:
    one = track("release-1,A", "release", 192)
    free = {
        "k_LC": LogUniform(2e7, 1.2e8),
        "mu": LogUniform(3e3, 3e6),
        "preload[release-1,A]": Fixed(6000.0),
        "release_time[release-1,A]": Fixed(15.4 * one.interval),
        "noise[acceleration,A]": Fixed(NOISE),
    }
    sheet = dataclasses.replace(SHEETS["acceleration"], noise=NOISE)
    group = ReleaseGroup((one,), effects(BASE))
    truth = {"k_LC": 6e7, "mu": 2e4}
    return problem(group, parameters(free), truth, 0, SHEETS | {"acceleration": sheet})


@pytest.fixture(scope="module")
def found(release: Problem) -> Found:
    return search(release, 8, 1)


@pytest.fixture(scope="module")
def grid(release: Problem) -> tuple[float, float]:
    """Share of the posterior below BETWEEN, and the log-evidence, by summing over a grid of z."""
    along = np.linspace(-REACH, REACH, POINTS)
    z = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    logs = log_density(release, z).reshape(POINTS, POINTS)
    mass = np.exp(logs - logs.max())
    soft = stiffness(release, np.stack([along, 0.0 * along], axis=1)) < BETWEEN
    area = (along[1] - along[0]) ** 2
    return float(mass[soft].sum() / mass.sum()), float(np.log(mass.sum() * area) + logs.max())


def stiffness(release: Problem, z: np.ndarray) -> np.ndarray:
    return np.asarray(release.parameters.values(jnp.asarray(z))["k_LC"])


def test_the_record_has_two_modes(found: Found, grid):
    assert len(found.optima) == 2
    assert 0.1 < grid[0] < 0.9


def test_weights_of_the_modes_are_those_of_the_grid(found: Found, release: Problem, grid):
    weights = propose(found, np.random.default_rng(0)).weights
    soft = stiffness(release, np.stack([o.z for o in found.optima])) < BETWEEN
    assert abs(weights.weights[soft].sum() - grid[0]) < 4 * weights.error.max()
    assert weights.error.max() < 0.02
    # The evidence's own error follows from the spread of the weights.
    draws = 2048 * len(found.optima)
    assert abs(weights.log_evidence - grid[1]) < 4 * np.sqrt((1 / weights.kish - 1) / draws)


@pytest.mark.parametrize("begin", [0, 1])
def test_a_chain_has_them_in_proportion_wherever_most_walkers_begin(
    found: Found, release: Problem, grid, begin: int
):
    modes = tuple(chart_of(release).mode(o) for o in found.optima)
    law = np.full(2, 0.1)
    law[begin] = 0.9
    proposal = MixtureProposal(modes, law, DOF)
    settings = Settings(
        ensembles=4, walkers=32, block=100, max_steps=6_000, r_hat=1.01, ess=2_000.0, seed=begin,
    )  # fmt: skip
    draws = sample(lambda z: np.asarray(log_posterior(release, jnp.asarray(z))), proposal, settings)
    assert draws.converged, draws.says
    soft = (stiffness(release, draws.z.reshape(-1, 2)) < BETWEEN).reshape(draws.z.shape[:-1])
    ess, _ = convergence.effective_sizes(soft.astype(float))
    assert abs(soft.mean() - grid[0]) < 4 * np.sqrt(grid[0] * (1 - grid[0]) / ess)
    assert ess > 500
