"""How JAX is set up for every command: 64-bit floats, and compiled programs kept between runs."""

import os
from pathlib import Path

CACHE = "RIGID_CACHE"
"""Environment variable that names the folder of compiled programs; empty: none are kept."""


def cache_folder() -> Path | None:
    """Folder of compiled programs, or None where none are to be kept."""
    given = os.environ.get(CACHE)
    if given is not None:
        return Path(given) if given else None
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "rigid" / "programs"


def prepare() -> None:
    """Set JAX up; call it before anything is compiled."""
    # Checks of equinox call back to Python, and JAX keeps no program that does.
    os.environ.setdefault("EQX_ON_ERROR", "nan")
    import jax

    jax.config.update("jax_enable_x64", True)
    folder = cache_folder()
    if folder is None:
        return
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)
