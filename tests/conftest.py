"""JAX as the commands set it up, before any test compiles; compiled programs kept between runs."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

# JAX writes a program into its folder as it goes: processes side by side need one each.
os.environ.setdefault(
    "RIGID_CACHE",
    str(
        Path(tempfile.gettempdir())
        / "rigid-test-programs"
        / os.environ.get("PYTEST_XDIST_WORKER", "")
    ),
)

# Tests change code as it runs: what is traced of it must not be kept.
os.environ.setdefault("RIGID_TRACINGS", "0")

from rigid.io.runtime import prepare
from rigid.jobs.memory import shed

prepare()


@pytest.fixture(autouse=True, scope="module")
def _room_for_programs() -> Iterator[None]:
    """A process of the suite compiles for hours' worth of campaigns: it too lets programs go."""
    yield
    shed(0)
