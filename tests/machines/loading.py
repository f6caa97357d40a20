"""The specs of these machines beside readings that are simulated."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from machines import simulated

import rigid

SPECS = Path(__file__).parent


def as_it_is(spec: str) -> str:
    """Leave the text of a spec alone."""
    return spec


def machine(
    name: str, folder: Path, text: Callable[[str], str] = as_it_is, **how: Any
) -> rigid.Study:
    """Load a machine with its simulated readings, its spec perhaps with another text.

    - `how`: what its simulation takes beside the file.
    """
    simulated.MACHINES[name](folder / f"{name}.csv", **how)
    return rigid.load(written(name, folder, text))


def noiseless(monkeypatch: pytest.MonkeyPatch, name: str, path: Path, **how: Any) -> dict:
    """Write what ideal sensors of a machine read; return the true numbers."""
    plain = simulated.written

    def without_noise(path, seed, columns):
        plain(path, seed, {key: (values, 0.0) for key, (values, _) in columns.items()})

    with monkeypatch.context() as here:
        here.setattr(simulated, "written", without_noise)
        return simulated.MACHINES[name](path, **how)


def written(name: str, folder: Path, text: Callable[[str], str] = as_it_is) -> Path:
    """Write a machine's spec and parts of its own, perhaps with another text."""
    for file in SPECS.glob("servo_valve.py"):
        shutil.copy(file, folder)
    path = folder / f"{name}.toml"
    path.write_text(text((SPECS / path.name).read_text("utf-8")), "utf-8")
    return path
