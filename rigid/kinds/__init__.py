"""Kinds of records, a class a file: whatever lies in this folder is a kind that a spec can name."""

import importlib
import pkgutil

from rigid.kinds.base import Position, RecordKind


def _found() -> dict[str, type[RecordKind]]:
    """All kinds of this folder by name, in the order of their ranks."""
    kinds = {
        thing
        for module in pkgutil.iter_modules(__path__, f"{__name__}.")
        for thing in vars(importlib.import_module(module.name)).values()
        if isinstance(thing, type) and issubclass(thing, RecordKind) and "name" in vars(thing)
    }
    listed = sorted(kinds, key=lambda kind: (kind.rank, kind.name))
    found = {kind.name: kind for kind in listed}
    assert len(found) == len(listed), "two kinds of record have one name"
    return found


KINDS = _found()


def kinds_with(trait: str) -> tuple[str, ...]:
    """Names of the kinds with a trait."""
    return tuple(name for name, kind in KINDS.items() if trait in kind.traits())


def require_kind(name: str) -> None:
    """Raise ValueError where there is no kind of a name."""
    if name not in KINDS:
        raise ValueError(f"unknown kind of record '{name}'; known are {', '.join(KINDS)}")


__all__ = ["KINDS", "Position", "RecordKind", "kinds_with", "require_kind"]
