"""Threads of linear algebra: one, unless the user has chosen; few looks for garbage."""

import json
import os
import subprocess
import sys

import pytest

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
assert gc.isenabled() and first and gc.get_threshold()[0] == ROOM
kept = [[] for _ in range(1000)]
with loading():
    assert gc.isenabled()
assert gc.get_freeze_count() <= first
"""


def test_garbage_is_not_looked_for_among_libraries_and_what_came_later_is_never_held():
    subprocess.run([sys.executable, "-c", COLLECTED], check=True)
