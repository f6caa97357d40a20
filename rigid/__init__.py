"""Bayesian parameter identification for hydraulic test rigs.

`rigid.load(spec)` returns a `Study`: `docs/library.md` shows what can be asked of it. The package
stays lazy: importing `rigid` loads nothing heavy, so that a command can print its first line before
JAX is there. JAX is set to 64 bits (`rigid.prepare`) when a name that computes is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rigid.io.version import __version__ as __version__

if TYPE_CHECKING:
    from rigid.inference.posterior import by_ensemble
    from rigid.io.errors import EnvironmentFaultError, InputError, RigidError
    from rigid.io.runtime import prepare
    from rigid.spec.record import RecordSpec as Record
    from rigid.spec.rig import RigSpec as Rig
    from rigid.study.check import Checked
    from rigid.study.density import LogPosterior
    from rigid.study.discovery import Discovery
    from rigid.study.fit import Fit
    from rigid.study.laws import Laws
    from rigid.study.parted import Parted
    from rigid.study.plan import Plan
    from rigid.study.study import Study, build, load
    from rigid.study.validation import Replicates, Validation

__all__ = [
    "Checked",
    "Discovery",
    "EnvironmentFaultError",
    "Fit",
    "InputError",
    "Laws",
    "LogPosterior",
    "Parted",
    "Plan",
    "Record",
    "Replicates",
    "Rig",
    "RigidError",
    "Study",
    "Validation",
    "build",
    "by_ensemble",
    "load",
    "prepare",
]

_HOMES = {
    "Checked": "study.check:Checked",
    "Discovery": "study.discovery:Discovery",
    "EnvironmentFaultError": "io.errors:EnvironmentFaultError",
    "Fit": "study.fit:Fit",
    "InputError": "io.errors:InputError",
    "Laws": "study.laws:Laws",
    "LogPosterior": "study.density:LogPosterior",
    "Parted": "study.parted:Parted",
    "Plan": "study.plan:Plan",
    "Record": "spec.record:RecordSpec",
    "Replicates": "study.validation:Replicates",
    "Rig": "spec.rig:RigSpec",
    "RigidError": "io.errors:RigidError",
    "Study": "study.study:Study",
    "Validation": "study.validation:Validation",
    "build": "study.study:build",
    "by_ensemble": "inference.posterior:by_ensemble",
    "load": "study.study:load",
    "prepare": "io.runtime:prepare",
}
"""Module and name there, by name."""

_LIGHT = ("io.", "spec.")
"""Rooms that compute nothing."""


def __getattr__(name: str) -> Any:
    """Look up a name where it is defined; one that computes sets JAX up first."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'rigid' has no attribute {name!r}")
    module, _, there = home.partition(":")
    if not module.startswith(_LIGHT):
        import_module("rigid.io.runtime").prepare()
    return getattr(import_module(f"rigid.{module}"), there)


def __dir__() -> list[str]:
    """Names for completion."""
    return sorted({*globals(), *__all__})
