"""JAX as the commands set it up, before any test compiles; compiled programs kept between runs."""

import os
import tempfile
from pathlib import Path

# JAX writes a program into its folder as it goes: processes side by side need one each.
os.environ.setdefault(
    "RIGID_CACHE",
    str(
        Path(tempfile.gettempdir())
        / "rigid-test-programs"
        / os.environ.get("PYTEST_XDIST_WORKER", "")
    ),
)

from rigid.io.runtime import prepare

prepare()
