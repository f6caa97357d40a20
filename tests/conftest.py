"""JAX as the commands set it up, before any test compiles; compiled programs kept between runs."""

import os
import tempfile
from pathlib import Path

os.environ.setdefault("RIGID_CACHE", str(Path(tempfile.gettempdir()) / "rigid-test-programs"))

from rigid.runtime import prepare

prepare()
