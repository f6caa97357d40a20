"""What made a result: versions of the packages, commit of the checkout, what was run."""

import importlib.metadata
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from rigid.io.version import __version__

PACKAGES = ("jax", "diffrax", "optimistix", "equinox", "emcee", "arviz", "numpy", "scipy", "xarray")


def versions() -> dict[str, str]:
    """Versions of the packages a result depends on."""
    return {"rigid": __version__} | {p: importlib.metadata.version(p) for p in PACKAGES}


def commit() -> str | None:
    """Commit of the checkout the package runs from, None outside one."""
    folder = Path(__file__).resolve().parents[2]
    if not (folder / ".git").exists():
        return None
    asked = subprocess.run(
        ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return asked.stdout.strip() or None


@dataclass(frozen=True)
class Invocation:
    """What was run: the command line, or the call of the library; since when, in what stages.

    - `stages`: title and time [s] of those that are over, added as the run goes.
    """

    command: str
    began: float = field(default_factory=time.monotonic)
    began_cpu: float = field(default_factory=time.process_time)
    stages: list[tuple[str, float]] = field(default_factory=list)

    @property
    def wall_s(self) -> float:
        """Time since it began [s]."""
        return time.monotonic() - self.began

    @property
    def cpu_s(self) -> float:
        """Processor time of this process since it began [s]."""
        return time.process_time() - self.began_cpu


_RUNNING: ContextVar[Invocation | None] = ContextVar("running", default=None)


@contextmanager
def running(command: str) -> Iterator[None]:
    """Say what is run, for as long as the block lasts; inside another such block, that one counts.

    - `command`: `python -m rigid.fit calibration --seed 3`, or a call of the library.
    """
    if _RUNNING.get() is not None:
        yield
        return
    token = _RUNNING.set(Invocation(command))
    try:
        yield
    finally:
        _RUNNING.reset(token)


def invocation() -> Invocation:
    """What is being run."""
    return _RUNNING.get() or Invocation("a program that calls rigid")
