"""Values as text and arrays, and back: of these is made what a run keeps; it cannot run code."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Kinds = Sequence[type]
Known = Mapping[str, Any]


def pack(value: Any, known: Known) -> tuple[Any, dict[str, np.ndarray]]:
    """Return what JSON can hold of a value, and its arrays by name.

    - `value`: numbers, text, arrays, classes, and tuples, lists, mappings, named tuples and
      dataclasses of such. - `known`: what is not kept, by name: the reader has it.

    Raises TypeError for anything else.
    """
    names, arrays = {id(one): name for name, one in known.items()}, dict[str, np.ndarray]()

    def packed(one: Any) -> Any:
        if id(one) in names:
            return {"known": names[id(one)]}
        if one is None or isinstance(one, bool | int | float | str):
            return one
        if isinstance(one, np.generic):
            return one.item()
        if isinstance(one, type):
            return {"class": one.__qualname__}
        if isinstance(one, Mapping):
            return {"items": [[packed(key), packed(item)] for key, item in one.items()]}
        if dataclasses.is_dataclass(one):
            inner = [getattr(one, f.name) for f in dataclasses.fields(one) if f.init]
            return {"kind": type(one).__qualname__, "fields": [packed(i) for i in inner]}
        if isinstance(one, tuple) and hasattr(one, "_fields"):
            return {"kind": type(one).__qualname__, "fields": [packed(i) for i in one]}
        if isinstance(one, list | tuple):
            return {type(one).__name__: [packed(i) for i in one]}
        if not hasattr(one, "__array__"):
            raise TypeError(f"{type(one).__qualname__}: a value of this kind cannot be kept")
        name = str(len(arrays))
        arrays[name] = np.asarray(one)
        return {"array": name}

    return packed(value), arrays


def unpack(tree: Any, arrays: Mapping[str, np.ndarray], kinds: Kinds, known: Known) -> Any:
    """Return the value that `pack` made a tree and arrays of.

    - `kinds`: classes that may be in it; no other is made.

    Raises KeyError, ValueError or TypeError where they are not of one.
    """
    named = {kind.__qualname__: kind for kind in kinds}

    def unpacked(one: Any) -> Any:
        if not isinstance(one, dict):
            return one
        if "kind" in one:
            kind, given = named[one["kind"]], [unpacked(i) for i in one["fields"]]
            if not dataclasses.is_dataclass(kind):
                return kind(*given)
            fields = [f.name for f in dataclasses.fields(kind) if f.init]
            return kind(**dict(zip(fields, given, strict=True)))
        ((sort, inner),) = one.items()
        if sort == "items":
            return {unpacked(key): unpacked(item) for key, item in inner}
        if sort in ("tuple", "list"):
            return {"tuple": tuple, "list": list}[sort](unpacked(i) for i in inner)
        return {"known": known, "class": named, "array": arrays}[sort][inner]

    return unpacked(tree)
