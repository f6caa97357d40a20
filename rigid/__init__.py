"""Bayesian parameter identification for hydraulic test rigs.

`rigid.load(spec)` returns a `Study`: `docs/library.md` shows what can be asked of it. The package
stays lazy: importing `rigid` loads nothing heavy, so that a command can print its first line before
JAX is there. JAX is set to 64 bits (`rigid.prepare`) when a name that computes is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigid.inference.posterior import by_ensemble
    from rigid.io.errors import EnvironmentFaultError, InputError, RigidError
    from rigid.io.runtime import prepare
    from rigid.study.check import Checked
    from rigid.study.density import LogPosterior
    from rigid.study.discovery import Discovery
    from rigid.study.fit import Fit
    from rigid.study.laws import Laws
    from rigid.study.study import Study, load

__version__ = "0.1.0"

__all__ = [
    "Checked",
    "Discovery",
    "EnvironmentFaultError",
    "Fit",
    "InputError",
    "Laws",
    "LogPosterior",
    "RigidError",
    "Study",
    "by_ensemble",
    "load",
    "prepare",
]

_HOMES = {
    "Checked": "study.check",
    "Discovery": "study.discovery",
    "EnvironmentFaultError": "io.errors",
    "Fit": "study.fit",
    "InputError": "io.errors",
    "Laws": "study.laws",
    "LogPosterior": "study.density",
    "RigidError": "io.errors",
    "Study": "study.study",
    "by_ensemble": "inference.posterior",
    "load": "study.study",
    "prepare": "io.runtime",
}
"""Modules that define the names, by name."""


def __getattr__(name: str) -> Any:
    """Look up a name where it is defined; one that computes sets JAX up first."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'rigid' has no attribute {name!r}")
    if not home.startswith("io."):
        import_module("rigid.io.runtime").prepare()
    return getattr(import_module(f"rigid.{home}"), name)


def __dir__() -> list[str]:
    """Names for completion."""
    return sorted({*globals(), *__all__})
