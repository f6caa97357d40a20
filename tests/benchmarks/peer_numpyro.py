"""NumPyro's NUTS through diffrax: what a gradient costs, and a shortened run on one release.

Importing this module needs `numpyro`.
"""

import time
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro  # pyright: ignore[reportMissingImports]
from campaign import Bench, median_time
from jax import Array
from reference import Stretch, begin, padded, solved, stretches
from release import alone

from rigid.inference.search import search_from
from rigid.likelihood.marginal import marginal_likelihood
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.problem import Problem
from rigid.physics.full import integrate
from rigid.physics.rest import rest_under
from rigid.physics.rig import Rig, Surroundings, build_rig
from rigid.physics.sensors import readings

TOLERANCE = 1e-6
STEP, WARM_UP = 0.02, 100
"""Of a leap, in sds of the law around the best fit, with which the warm-up begins; its draws."""


@dataclass(frozen=True)
class Nuts:
    """Seconds a gradient of the whole campaign takes, and what the shortened run did."""

    gradient: float
    draws: int
    steps: float
    seconds: float


def measured(bench: Bench) -> Nuts:
    """The cost of one gradient, then the run."""
    return Nuts(gradient_seconds(bench), *shortened(bench, bench.choose(5, 20)))


@eqx.filter_jit
def pulled_back(rig: Rig, outside: Surroundings, start: Array, times: Array) -> tuple:
    """Value and gradient of a sum over states, in reverse mode as NUTS takes it."""

    def total(inputs: tuple[Rig, Surroundings, Array]) -> Array:
        path = integrate(*inputs, times, TOLERANCE)
        return jnp.sum(path / jnp.asarray(rig.scales))

    return eqx.filter_value_and_grad(total)((rig, outside, start))


def gradient_seconds(bench: Bench) -> float:
    """Sum over all stretches of all records at one point of the posterior."""
    problem, total = bench.problem, 0.0
    listed = problem.parameters.values(jnp.asarray(bench.draws(1)))
    values = {k: v[0] for k, v in listed.items()}
    for group in problem.groups:
        for track in group.tracks:
            seen = Scoped(values, track.scope)
            rig = build_rig(problem.effects, seen)
            state = begin(track, rig, values)
            for stretch in stretches(track, seen):
                total += _stretch_seconds(rig, stretch, state, bench.choose(1, 3))
                state = solved(rig, stretch[0], state, padded(stretch[1]), TOLERANCE)[0]
    return total


def _stretch_seconds(rig: Rig, stretch: Stretch, state: Array, runs: int) -> float:
    outside, times, _ = stretch
    outside = Surroundings(*(jnp.asarray(x, dtype=float) for x in outside))
    return median_time(
        lambda: jax.block_until_ready(pulled_back(rig, outside, state, padded(times))), runs
    )


def log_likelihood(problem: Problem, z: Array) -> Array:
    """Of one release through diffrax, z (size,)."""
    listed = problem.parameters.values(z[None])
    track, values = problem.groups[0].tracks[0], {k: v[0] for k, v in listed.items()}
    rig = build_rig(problem.effects, Scoped(values, track.scope))
    onset = track.onset or 0
    delay = track.onset_time - values[f"release_time[{track.label}]"]
    after = delay + track.interval * jnp.arange(track.samples - onset)
    times = jnp.concatenate([jnp.zeros(1), after])
    path = integrate(
        rig, Surroundings(), rest_under(rig, values[f"preload[{track.label}]"]), times, TOLERANCE
    )
    series = jax.vmap(lambda y: readings(rig, y, Surroundings()).acceleration)(path)[1:]
    whole = jnp.zeros(track.samples).at[onset:].set(series)
    return marginal_likelihood(
        problem.pieces, [{"acceleration": whole[:, None, None]}], listed
    ).value[0]


def shortened(bench: Bench, draws: int) -> tuple[int, float, float]:
    """Draws, gradients a draw and seconds of NUTS on one release.

    Covariance and best fit are given to it. From NumPyro's own first step, 1, it did not end in 13
    minutes: such leaps lead to rigs that no integrator is done with.
    """
    problem = alone(bench.problem)
    best = search_from(problem, bench.draws(1)).optima[0]

    def model() -> None:
        law = numpyro.distributions.Normal(0.0, 1.0).expand([problem.parameters.size]).to_event(1)
        z = numpyro.sample("z", law)
        numpyro.factor("likelihood", log_likelihood(problem, z))

    kernel = numpyro.infer.NUTS(
        model,
        init_strategy=numpyro.infer.init_to_value(values={"z": jnp.asarray(best.z)}),
        step_size=STEP,
        inverse_mass_matrix=jnp.asarray(best.covariance),
        adapt_mass_matrix=False,
        dense_mass=True,
    )
    run = numpyro.infer.MCMC(kernel, num_warmup=WARM_UP, num_samples=draws, progress_bar=False)
    began = time.perf_counter()
    run.run(jax.random.PRNGKey(1), extra_fields=("num_steps",))
    steps = np.asarray(run.get_extra_fields()["num_steps"])
    return draws, float(steps.mean()), time.perf_counter() - began
