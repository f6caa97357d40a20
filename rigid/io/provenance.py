"""What made a result: versions of the packages, commit of the checkout."""

import importlib.metadata
import subprocess
from pathlib import Path

from rigid import __version__

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
