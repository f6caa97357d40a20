"""What a program is traced from, as text that is the same in every process that traces the same.

A tracing depends on the code, on the shapes of arrays and on all values that are no arrays. The
text says the latter two in full; where something has no such text there is none.
"""

import dataclasses
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

OURS = "rigid"
"""The package whose code a program is kept with."""
LIBRARIES = ("diffrax", "equinox", "jax", "jaxlib", "jaxtyping", "lineax", "numpy", "optimistix")
"""Packages whose versions it is kept with."""
MADE = "made"
"""Attribute of a class that a function has made: the function and its arguments."""


class NoStructureError(Exception):
    """A value that text does not tell in full: a program that is traced from it is not kept."""


def structure(value: Any, is_array: Callable[[Any], bool]) -> str:
    """Describe a value: arrays by shape and type, all else by what it is.

    - `is_array`: whether a value is an array.

    Raises NoStructureError for code of other packages than these, functions and classes made inside
    functions that do not say so, and objects of unknown kinds.
    """
    return " ".join(_told(value, is_array))


def _told(value: Any, is_array: Callable[[Any], bool]) -> Iterator[str]:
    if value is None or isinstance(value, bool | int | float | str):
        yield f"{type(value).__name__} {value!r}"
        return
    if is_array(value):
        weak = getattr(value, "weak_type", False)
        yield f"array {value.dtype.name} {tuple(value.shape)} {weak}"
        return
    kind, parts = _parts(value)
    yield f"{kind} ("
    for part in parts:
        yield from _told(part, is_array)
    yield ")"


def _parts(value: Any) -> tuple[str, Iterable[Any]]:
    """What a value is, and what it is made of."""
    made = vars(value).get(MADE) if isinstance(value, type) else None
    if made is not None:
        maker, arguments = made
        if maker(*arguments) is not value:
            raise NoStructureError(f"{value}: not what {maker} makes of {arguments}")
        return named(maker), arguments
    if callable(value) and hasattr(value, "__qualname__"):
        return named(value), ()
    return "one of", (type(value), *_within(value))


def _within(value: Any) -> Iterable[Any]:
    """What an instance holds."""
    if isinstance(value, Mapping):
        return (part for item in value.items() for part in item)
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, tuple | list):
        return value
    if not dataclasses.is_dataclass(value):
        raise NoStructureError(f"{type(value)}: of no kind that is known")
    fields = [field.name for field in dataclasses.fields(value)]
    if more := getattr(value, "__dict__", {}).keys() - set(fields):
        raise NoStructureError(f"{type(value)}: has {', '.join(more)} beside its fields")
    return (getattr(value, name) for name in fields)


def named(code: Any) -> str:
    """Module and name of a class or function.

    Raises NoStructureError where that is not found there, or its code may change unseen.
    """
    module, name = code.__module__, code.__qualname__
    if module.split(".")[0] not in (OURS, "builtins", *LIBRARIES):
        raise NoStructureError(f"{module}:{name}: code that programs are not kept with")
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    if found is not code and getattr(found, "__wrapped__", None) is not code:
        raise NoStructureError(f"{module}:{name}: not what is found there")
    return f"{module}:{name}"
