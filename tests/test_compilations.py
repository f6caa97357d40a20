"""One compilation a program, none while the sampler runs, and none at all in a second process."""

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import monitoring
from rigs import release_problem

from rigid.inference.proposal import MixtureProposal, Mode
from rigid.inference.sample import Settings, sample
from rigid.likelihood.problem import log_density, log_posterior, walkers

COMPILED = "/jax/core/compile/backend_compile_duration"


@contextmanager
def compilations() -> Iterator[Counter]:
    """Count compilations by the name of the program, those taken from the cache included."""
    found: Counter = Counter()

    def listen(event: str, duration_secs: float, **kwargs: str | int) -> None:
        if event == COMPILED:
            found[str(kwargs.get("fun_name", "?"))] += 1

    monitoring.register_event_duration_secs_listener(listen)
    try:
        yield found
    finally:
        monitoring.unregister_event_duration_listener(listen)


def short_run(problem, log_prob) -> None:
    """Two blocks of two ensembles, from a Gaussian around the centre of the prior."""
    size = problem.parameters.size
    proposal = MixtureProposal((Mode(np.zeros(size), 0.1 * np.eye(size), 0.0),), np.ones(1))
    settings = Settings(ensembles=2, walkers=walkers(problem), block=10, max_steps=20, ess=1.0)
    sample(log_prob, proposal, settings)


def batched(problem):
    """The log-posterior as `rigid.inference.calibrate` hands it to the sampler."""
    return lambda z: np.asarray(log_posterior(problem, jnp.asarray(z)))


def one_by_one(problem):
    """Broken on purpose: what asks for points one shape after the other."""

    def density(z: np.ndarray) -> np.ndarray:
        n = 1 + int(abs(z[0, 0]) * 1e6) % 2
        parts = [log_posterior(problem, jnp.asarray(z[i : i + n])) for i in range(0, len(z), n)]
        return np.concatenate(parts)

    return density


@pytest.fixture
def problem():
    jax.clear_caches()  # other tests may have compiled the very same shapes
    return release_problem({}, samples=64)


@pytest.mark.slow
def test_the_log_posterior_is_compiled_once_before_a_run_and_never_during_it(problem):
    with compilations() as before:
        log_density(problem, np.zeros((1, problem.parameters.size)))
    assert before["jit(evaluate)"] == 1, before
    short_run(problem, batched(problem))  # what NumPy asks of JAX around it
    with compilations() as during:
        short_run(problem, batched(problem))
    assert not during


@pytest.mark.slow
def test_new_data_of_the_same_shape_need_no_new_program(problem):
    log_density(problem, np.zeros((1, problem.parameters.size)))
    other = release_problem({}, samples=64, seed=1)
    with compilations() as found:
        log_density(other, np.zeros((1, problem.parameters.size)))
    assert not found["jit(evaluate)"]


@pytest.mark.slow
def test_the_count_sees_batches_of_changing_shape(problem):
    log_density(problem, np.zeros((1, problem.parameters.size)))
    with compilations() as found:
        short_run(problem, one_by_one(problem))
    assert found["jit(evaluate)"] > 1


COUNTED = """
import json
from rigid.io.runtime import prepare
prepare()
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
asked, hits = [], []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, _, **about: asked.append(str(about.get("fun_name")))
    if event == "/jax/core/compile/backend_compile_duration" else None
)
jax.monitoring.register_event_listener(
    lambda event, **_: hits.append(event) if event == "/jax/compilation_cache/cache_hits" else None
)
BODY
print(json.dumps({"asked": asked, "hits": len(hits)}))
"""

FIT = """
from rigs import release_problem
from rigid.inference.calibrate import propose
from rigid.inference.derived import evaluations, frictions, values_of
from rigid.inference.search import search
from test_compilations import batched, short_run
found = search(release_problem({}, samples=64), 2, 1)
propose(found, np.random.default_rng(1))
short_run(found.problem, batched(found.problem))
z = found.optima[0].z[None]
frictions(found.problem, values_of(found.problem, z))
evaluations(found.problem, z)
"""

CHECKED = """
checked = eqx.filter_jit(lambda x: eqx.error_if(x, x > 1.0, "too large"))
checked(jnp.zeros(3)).block_until_ready()
"""


def programs(body: str, cache: Path, **environment: str) -> dict:
    """Run `body` in a process of its own; programs it asked for, and hits of the cache."""
    given = {k: v for k, v in os.environ.items() if k != "EQX_ON_ERROR"} | environment
    given |= {"RIGID_CACHE": str(cache), "PYTHONPATH": str(Path(__file__).parent)}
    command = sys.executable, "-c", COUNTED.replace("BODY", body)
    done = subprocess.run(command, env=given, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
@pytest.mark.long
def test_a_second_process_finds_every_program_of_a_fit_in_the_cache(tmp_path: Path):
    first = programs(FIT, tmp_path)
    assert {"jit(evaluate)", "jit(_led)"} <= set(first["asked"])
    again = programs(FIT, tmp_path)
    assert again["hits"] == len(again["asked"])


@pytest.mark.slow
def test_programs_with_checks_are_kept_only_as_the_runtime_sets_them_up(tmp_path: Path):
    """Checks that call Python keep a program out of the cache of jax 0.10 (0.12 stores it): so the
    test above can fail.
    """
    ways = [("nan", True)] + [("raise", False)] * (jax.__version_info__ < (0, 11))
    for way, kept in ways:
        programs(CHECKED, tmp_path / way, EQX_ON_ERROR=way)
        again = programs(CHECKED, tmp_path / way, EQX_ON_ERROR=way)
        assert "jit(<lambda>)" in again["asked"]
        assert (again["hits"] == len(again["asked"])) == kept


def test_what_is_asked_of_a_problem_does_not_have_it_compiled_again():
    """A value that equinox keeps beside a module's fields would be another structure."""
    problem = release_problem({}, samples=64)
    before = jax.tree.structure(problem)
    for name, value in vars(type(problem)).items():
        if isinstance(value, property | cached_property):
            getattr(problem, name)
    assert jax.tree.structure(problem) == before


TRACED = """
import json
from rigid.io.runtime import prepare
prepare(as_command=True)
import jax
import numpy as np
from rigs import release_problem
from rigid.inference.search import search
from rigid.likelihood.problem import log_density
traced = []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, _, **about: traced.append(str(about.get("fun_name")))
    if event == "/jax/core/compile/jaxpr_trace_duration" else None
)
problem = release_problem({}, samples=64)
best = search(problem, 2, 1).optima[0].z
print(json.dumps({"traced": traced, "value": float(log_density(problem, best[None])[0])}))
"""


def told(cache: Path, tracings: str) -> dict:
    """Search a small release in a process of its own: what was traced, and the best value."""
    given = os.environ | {"RIGID_CACHE": str(cache), "RIGID_TRACINGS": tracings}
    given["PYTHONPATH"] = str(Path(__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", TRACED], env=given, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_a_command_traces_nothing_that_one_before_has_traced(tmp_path: Path):
    plain, again, first, second = (told(tmp_path, kept) for kept in ("0", "0", "1", "1"))
    # Inside `_led` optimistix has a function `_fn`. Without tracings it is traced again.
    assert ["_fn" in one["traced"] for one in (plain, again, first, second)] == [True] * 3 + [False]
    assert plain["value"] == again["value"] == first["value"] == second["value"]
