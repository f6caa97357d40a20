"""Threads of linear algebra: one, unless the user has chosen; few looks for garbage; compilers."""

import json
import os
import subprocess
import sys

import pytest

from rigid.io import runtime
from rigid.io.runtime import THREADS

TOLD = """
import json, rigid
rigid.prepare()
from threadpoolctl import threadpool_info
print(json.dumps([one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]))
"""


def _threads(**given: str) -> set[int]:
    environment = {name: value for name, value in os.environ.items() if name not in THREADS}
    done = subprocess.run(
        [sys.executable, "-c", TOLD], env=environment | given, capture_output=True, check=True
    )
    return set(json.loads(done.stdout))


def test_linear_algebra_runs_on_one_thread():
    assert _threads() == {1}


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="a machine of one core has one thread")
def test_a_number_of_threads_that_the_user_chose_is_kept():
    assert _threads(OPENBLAS_NUM_THREADS="2") == {2}


COLLECTED = """
import gc
from rigid.io.runtime import ROOM, loading
with loading():
    assert not gc.isenabled()
first = gc.get_freeze_count()
assert gc.isenabled() and first and gc.get_threshold() == ROOM
kept = [[] for _ in range(1000)]
with loading():
    assert gc.isenabled()
assert gc.get_freeze_count() <= first
"""


def test_garbage_is_not_looked_for_among_libraries_and_what_came_later_is_never_held():
    subprocess.run([sys.executable, "-c", COLLECTED], check=True)


def compiled_with(monkeypatch, jaxlib: str, given: str) -> list[str]:
    monkeypatch.setattr(runtime, "version", lambda _: jaxlib)
    monkeypatch.setenv("XLA_FLAGS", given)
    runtime.prepare()
    return os.environ["XLA_FLAGS"].split()


def test_a_compiler_is_told_only_what_it_knows_and_a_user_has_the_last_word(monkeypatch):
    emitters, level = runtime.QUICK_COMPILER
    assert compiled_with(monkeypatch, "0.10.2", "") == [emitters, level]
    assert compiled_with(monkeypatch, "0.12.0.1", "") == [level]
    assert compiled_with(monkeypatch, "0.99.0", "") == []
    own = "--xla_backend_optimization_level=3"
    assert compiled_with(monkeypatch, "0.10.2", own) == [emitters, level, own]
    assert compiled_with(monkeypatch, "0.10.2", f"{emitters} {level}") == [emitters, level]


def test_how_programs_of_a_device_are_compiled_is_left_alone(monkeypatch):
    monkeypatch.setattr(runtime.importlib.util, "find_spec", lambda _: object())
    assert compiled_with(monkeypatch, "0.10.2", "") == []


def test_this_compiler_knows_its_settings():
    program = "import rigid, jax.numpy; rigid.prepare(); jax.numpy.ones(2).sum()"
    environment = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)
