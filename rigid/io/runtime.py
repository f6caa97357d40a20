"""How numerical libraries are set up for every command.

JAX computes in 64-bit floats and keeps compiled programs between runs; linear algebra of NumPy and
SciPy runs on one thread.
"""

import gc
import importlib.util
import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from rigid.io.errors import EnvironmentFaultError

CACHE = "RIGID_CACHE"
"""Environment variable that names the folder of compiled programs; empty: none are kept."""
TRACINGS = "RIGID_TRACINGS"
"""Environment variable: 1 where what JAX has traced is kept there, too."""

NEVER = ("0", "false", "off", "no", "f", "n")
"""Values of JAX_ENABLE_X64 with which JAX stays at 32 bits."""

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables by which a user chooses the threads of linear algebra."""


QUICK_COMPILER = {
    "--xla_cpu_use_fusion_emitters=false": (0, 10),
    "--xla_backend_optimization_level=1": (0, 12),
}
"""How XLA is to compile for processors, and the last version of jaxlib that is known to have each
setting: XLA ends a process that gives it one it does not know. Programs of many small operations
compile in 0.4 to 0.8 of the time, and most run about as fast; exponentials take three
times as long (docs/studies/speed-notes.md)."""

ROOM = (50_000, 20, 50)
"""When Python looks for garbage in cycles: among new objects after so many, among those that stayed
after so many such looks, among all after so many of these. It would be 700, 10, 10."""


def cache_folder() -> Path | None:
    """Folder of compiled programs, or None where none are to be kept."""
    given = os.environ.get(CACHE)
    if given is not None:
        return Path(given) if given else None
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "rigid" / "programs"


def prepare(*, as_command: bool = False) -> None:
    """Set up the whole process: 64-bit floats, quick compiling, kept programs, one thread of BLAS.

    - `as_command`: what is traced is kept, too, since no one changes the code while it runs.

    Call it before anything is compiled. Arrays that JAX made in 32 bits before stay as they are;
    those of rigid are made afterwards. A folder that the user has chosen is kept, and so is a
    number of threads that stands in the environment.

    Raises EnvironmentFaultError where the environment holds JAX to 32 bits.
    """
    if os.environ.get("JAX_ENABLE_X64", "").lower() in NEVER:
        raise EnvironmentFaultError(
            "the environment variable JAX_ENABLE_X64 holds JAX to 32 bits, in which likelihoods "
            "are wrong by more than they differ; unset it or set it to 1"
        )
    # Checks of equinox call back to Python, and JAX keeps no program that does.
    os.environ.setdefault("EQX_ON_ERROR", "nan")
    _compile_quickly()
    import jax

    jax.config.update("jax_enable_x64", True)
    if as_command:
        os.environ.setdefault(TRACINGS, "1")
    _one_thread()
    folder, chosen = cache_folder(), jax.config.values.get("jax_compilation_cache_dir")
    if folder is None or chosen is not None:
        return
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)


def tracings() -> Path | None:
    """Folder of what JAX has traced; None where none is to be kept.

    A library's user may change the code that is running, a device has programs of its own.
    """
    import jax

    wanted = os.environ.get(TRACINGS) == "1" and not jax.config.values["jax_debug_nans"]
    return cache_folder() if wanted and jax.default_backend() == "cpu" else None


def _compile_quickly() -> None:
    """Set how XLA compiles, before it is first used; what a user has set wins.

    A device's programs are left alone: there the level of optimisation has not been measured.
    """
    if importlib.util.find_spec("jax_plugins") is not None:
        return
    here = tuple(int(part) for part in version("jaxlib").split(".")[:2])
    given = os.environ.get("XLA_FLAGS", "").split()
    known = [flag for flag, last in QUICK_COMPILER.items() if here <= last and flag not in given]
    os.environ["XLA_FLAGS"] = " ".join([*known, *given])


@contextmanager
def loading() -> Iterator[None]:
    """Load the libraries of a command, the first in its process, with few looks for garbage.

    They and the programs that JAX traces are a million objects that stay. Each look at all of them
    takes a third of a second: none is taken while they are loaded, what they leave is not looked at
    again, and later looks are rare.
    """
    if gc.get_freeze_count():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.set_threshold(*ROOM)
        gc.enable()


def _one_thread() -> None:
    """Hold linear algebra to one thread.

    Matrices here are some thousand times some ten. Where cores are shared or virtual, threads of
    OpenBLAS wait for each other: a product that takes 8 ms on one thread took 850 ms on two. Work
    is spread over cores by JAX and by workers.
    """
    if any(os.environ.get(name) for name in THREADS):
        return
    import scipy.linalg  # SciPy brings a library of its own; only those loaded are held  # noqa: F401
    from threadpoolctl import threadpool_limits

    threadpool_limits(1, user_api="blas")


def require_double() -> None:
    """Refuse to compute in 32 bits.

    Raises EnvironmentFaultError where JAX makes floats of 32 bits.
    """
    import jax.numpy as jnp

    if jnp.result_type(float) != jnp.float64:
        raise EnvironmentFaultError(
            "JAX computes in 32 bits here, in which likelihoods are wrong by more than they "
            "differ; call rigid.prepare() first, or jax.config.update('jax_enable_x64', True)"
        )
