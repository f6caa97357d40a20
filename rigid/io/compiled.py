"""Functions that are compiled once for all arguments of one structure, in whatever process.

JAX keeps what XLA makes of a program, but has to trace and lower it in every process to find it
again: 11 % of the processor time of a fit whose programs are kept, 18 % of a discovery's. Here what
was lowered is kept as well (`jax.export`), by the code of the package, the versions of the
libraries, and the structure of the arguments.
"""

import hashlib
import os
from collections.abc import Callable, Hashable, Iterator
from contextlib import suppress
from functools import cache, update_wrapper
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Any, Generic, NamedTuple, ParamSpec, TypeVar
from weakref import WeakSet

import equinox as eqx
import jax
import numpy as np
from jax import export
from jax.core import Tracer

from rigid.io.cache import Shelf
from rigid.io.errors import EnvironmentFaultError
from rigid.io.files import locked
from rigid.io.runtime import tracings
from rigid.io.structure import LIBRARIES, OURS, NoStructureError, named, structure

P = ParamSpec("P")
T = TypeVar("T")

_ALL: WeakSet["Compiled"] = WeakSet()
_IN_TURN, _REGISTERED = Lock(), set[str]()
"""Threads write and register in turn; what has been registered is not again."""
SETTINGS = ("jax_enable_x64", "jax_default_matmul_precision", "jax_numpy_dtype_promotion")
"""Of JAX, by which it traces otherwise."""


class Kept(NamedTuple):
    """A program as it is kept.

    - `exported`: bytes that `jax.export` writes. - `classes`: named tuples that its result is made
      of, as "module:name". - `fixed`: leaves of the result that are no arrays, None for all others.
    """

    exported: np.ndarray
    classes: tuple[str, ...]
    fixed: tuple[Any, ...]


class Compiled(Generic[P, T]):
    """A function that is compiled for the structure of its arguments.

    What is no array is fixed in the program, as with `equinox.filter_jit`. That does the work where
    tracings are not kept (`rigid.prepare`), inside another program, and where arguments or result
    cannot be told by text.
    """

    def __init__(self, function: Callable[P, T]):
        self._function = function
        self._plain: Any = eqx.filter_jit(function)
        self._programs: dict[Hashable, Any] = {}
        self._locks: dict[Hashable, Lock] = {}
        update_wrapper(self, function)
        _ALL.add(self)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the function, compiled."""
        program, arrays = self._asked(args, kwargs)
        return self._plain(*args, **kwargs) if program is None else program(*arrays)

    def lower(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Make the program ready, so that only XLA's compiling is left."""
        program, arrays = self._asked(args, kwargs)
        if program is None:
            self._plain.lower(*args, **kwargs)
        else:
            program.run.lower(*arrays)

    def forget(self) -> None:
        """Let go of all programs."""
        self._programs.clear()
        self._locks.clear()

    def _asked(self, args: tuple, kwargs: dict) -> tuple[Any, list]:
        """Return program and arrays of a call; None: it is left to equinox."""
        folder = None if kwargs else tracings()
        if folder is None:
            return None, []
        leaves, tree = jax.tree.flatten(args)
        arrays = [leaf for leaf in leaves if eqx.is_array(leaf)]
        if any(isinstance(leaf, Tracer) for leaf in arrays):
            return None, []
        key = (tree, *(_kind(leaf) for leaf in leaves))
        if key not in self._programs:
            with self._locks.setdefault(key, Lock()):  # others wait for what one traces
                if key not in self._programs:
                    self._programs[key] = self._made(args, folder)
        return self._programs[key], arrays

    def _made(self, args: tuple, folder: Path) -> Any:
        """Read a program, or trace and keep it; None where it cannot be kept."""
        try:
            asked = structure((self._function, *args), eqx.is_array)
        except NoStructureError:
            return None
        mark = hashlib.sha256(f"{_here()} {asked}".encode()).hexdigest()
        shelf, name = Shelf(folder, {}, reads=True), f"{self._function.__name__}-{mark}"
        with suppress(EnvironmentFaultError):  # of a disk
            if (kept := shelf.read(name, (Kept,))) and (made := _program(self._function, kept)):
                return made
        kept = self._traced(args)
        if kept is None:
            return None
        # Where another process is writing, the next run traces once more.
        with suppress(EnvironmentFaultError), _IN_TURN, locked(folder):
            shelf.put(name, kept)
        return _program(self._function, kept)

    def _traced(self, args: tuple) -> Kept | None:
        """Trace and lower the function; None where that fails, or cannot be written down."""
        leaves, tree = jax.tree.flatten(args)
        others = [None if eqx.is_array(leaf) else leaf for leaf in leaves]
        fixed: list[Any] = []

        def of_arrays(*arrays: Any) -> Any:
            given = iter(arrays)
            whole = [next(given) if one is None else one for one in others]
            found = self._function(*jax.tree.unflatten(tree, whole))  # type: ignore[call-arg]
            moving, rest = eqx.partition(found, eqx.is_array)
            fixed[:] = _leaves(rest)
            return moving

        try:
            program = jax.jit(_called(self._function, of_arrays))
            exported = export.export(program)(*(leaf for leaf in leaves if eqx.is_array(leaf)))
            classes = tuple(dict.fromkeys(_named_tuples(exported.out_tree)))
            _register(classes)
            structure(fixed, eqx.is_array)
            return Kept(np.frombuffer(exported.serialize(), np.uint8), classes, tuple(fixed))
        except (NoStructureError, NotImplementedError, TypeError, ValueError):
            return None  # equinox raises it again where it is the function's own fault


def _leaves(tree: Any) -> list[Any]:
    """Leaves of a tree; a None is one."""
    return jax.tree.leaves(tree, is_leaf=lambda one: one is None)


def _program(function: Callable, kept: Kept) -> "_Program | None":
    """Read a program; None where it is not one."""
    try:
        _register(kept.classes)
        exported = export.deserialize(bytearray(kept.exported.tobytes()))
    except (AttributeError, ImportError, ValueError):
        return None
    return _Program(jax.jit(_called(function, exported.call)), kept.fixed)


class _Program(NamedTuple):
    """A program that takes arrays alone, and what of its result is none."""

    run: Any
    fixed: tuple[Any, ...]

    def __call__(self, *arrays: Any) -> Any:
        found = self.run(*arrays)
        if all(one is None for one in self.fixed):
            return found
        leaves, tree = jax.tree.flatten(found, is_leaf=lambda one: one is None)
        pairs = zip(leaves, self.fixed, strict=True)
        return jax.tree.unflatten(tree, [b if a is None else a for a, b in pairs])


def _kind(leaf: Any) -> Hashable:
    """What of a leaf is fixed in a program."""
    if eqx.is_array(leaf):
        return leaf.shape, leaf.dtype, getattr(leaf, "weak_type", False)
    return type(leaf), leaf


def _called(function: Callable, other: Callable) -> Callable:
    """Return a function that has the name of another: programs are known by it."""

    def call(*arrays: Any) -> Any:
        return other(*arrays)

    call.__name__ = call.__qualname__ = function.__name__
    return call


def _named_tuples(tree: Any) -> Iterator[str]:
    """Name the classes of the named tuples in a result, as "module:name"."""
    if (node := tree.node_data()) is not None:
        kind = node[0]
        if issubclass(kind, tuple) and kind is not tuple:
            yield named(kind)
    for child in tree.children():
        yield from _named_tuples(child)


def _register(classes: tuple[str, ...]) -> None:
    """Make named tuples known to `jax.export`.

    Raises ValueError for one of another package, ImportError or AttributeError where it is not.
    """
    with _IN_TURN:
        for name in set(classes) - _REGISTERED:
            module, _, inside = name.partition(":")
            if module.split(".")[0] != OURS:
                raise ValueError(f"{name}: of another package")
            kind: Any = getattr(import_module(module), inside)
            export.register_namedtuple_serialization(kind, serialized_name=name)
            _REGISTERED.add(name)


@cache
def _here() -> str:
    """Digest of what programs are traced by: code of the package, libraries, settings."""
    known = hashlib.sha256()
    root = Path(__file__).parents[1]
    for path in sorted(root.rglob("*.py")):
        known.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    versions = [f"{name} {version(name)}" for name in LIBRARIES]
    settings = [f"{name} {jax.config.values[name]}" for name in SETTINGS]
    checks = os.environ.get("EQX_ON_ERROR", "")
    known.update(" ".join([*versions, *settings, checks]).encode())
    return known.hexdigest()


def compiled(function: Callable[P, T]) -> Compiled[P, T]:
    """Have a function of a module compiled where it is called (`Compiled`)."""
    return Compiled(function)


def forget() -> None:
    """Let go of the programs of all functions; those that are kept are read again."""
    for one in list(_ALL):
        one.forget()
    jax.clear_caches()
