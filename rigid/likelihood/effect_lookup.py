"""Effects by the names that a spec gives them: those of the catalogue, and a user's own.

An effect of one's own is a class in a Python file beside the spec, or in an installed package; a
spec names it as `my_module:MyEffect`, or by the file, `../my_module.py:MyEffect`.
"""

import contextlib
import hashlib
import importlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TypeGuard

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.placed import origin
from rigid.io.errors import InputError
from rigid.likelihood.parameters import require_known

OWN = ":"
"""Stands between module and class."""
SUFFIX = ".py"


def effects_named(
    names: Iterable[str], folder: Path, where: str
) -> tuple[type[AbstractEffect], ...]:
    """Look effects up.

    - `folder`: of the spec. - `where`: heads the message.

    Raises InputError for a name that is not in the catalogue, and for a module or class that is
    not there or is no effect.
    """
    names = tuple(names)
    require_known((name for name in names if OWN not in name), CATALOGUE, where)
    return tuple(_own(name, folder, where) if OWN in name else CATALOGUE[name] for name in names)


def name_in_specs(effect: type[AbstractEffect], folder: Path) -> str:
    """Return what a spec in a folder has to say to mean an effect."""
    effect = origin(effect)
    if CATALOGUE.get(effect.name) is effect:
        return effect.name
    module = sys.modules[effect.__module__]
    file = Path(effect.__module__)
    if file.suffix != SUFFIX:  # of a package: found from everywhere
        return f"{module.__name__}{OWN}{effect.__qualname__}"
    path = Path(os.path.relpath(file, folder.resolve())).as_posix()
    return f"{path}{OWN}{effect.__qualname__}"


def marks(effects: Iterable[type[AbstractEffect]]) -> dict[str, str]:
    """SHA-256 of the files that hold effects of a user's own, by the effect's name."""
    own = [e for e in map(origin, effects) if CATALOGUE.get(e.name) is not e]
    files = {e.name: sys.modules[e.__module__].__file__ for e in own}
    return {
        name: hashlib.sha256(Path(file).read_bytes()).hexdigest()
        for name, file in files.items()
        if file is not None
    }


def _own(name: str, folder: Path, where: str) -> type[AbstractEffect]:
    """Import a user's effect; files beside the spec go before installed packages."""
    module_name, _, class_name = name.rpartition(OWN)
    file = folder / (module_name if module_name.endswith(SUFFIX) else module_name + SUFFIX)
    try:
        module = _load(file) if file.is_file() else importlib.import_module(module_name)
    except (ImportError, ValueError) as error:
        raise InputError(
            f"{where}: cannot import '{module_name}' of '{name}': {error}; put {file.name} into "
            f"{folder} or install it"
        ) from error
    except Exception as error:  # whatever the user's file does wrong
        raise InputError(f"{where}: {file} of '{name}' fails: {error}") from error
    found = getattr(module, class_name, None)
    if not _is_effect(found):
        own = [
            k for k, v in vars(module).items() if _is_effect(v) and v.__module__ == module.__name__
        ]
        raise InputError(
            f"{where}: {module.__file__} has no effect '{class_name}'; effects are classes derived "
            f"from rigid.effects.AbstractEffect, it has {', '.join(own) or 'none'}"
        )
    if found.name in CATALOGUE:
        raise InputError(
            f"{where}: '{name}' calls itself '{found.name}', as an effect of the catalogue does; "
            "give it another name"
        )
    return found


def _is_effect(thing: object) -> TypeGuard[type[AbstractEffect]]:
    return isinstance(thing, type) and issubclass(thing, AbstractEffect)


def _load(file: Path) -> ModuleType:
    """Run a file once, as a module whose name is its path: two folders may hold the same name."""
    path = str(file.resolve())
    if path not in sys.modules:
        plan = importlib.util.spec_from_file_location(path, path)
        assert plan is not None  # a file with this suffix has a loader
        assert plan.loader is not None
        module = importlib.util.module_from_spec(plan)
        sys.modules[path] = module
        try:
            with _on_path(file.parent):
                plan.loader.exec_module(module)
        except BaseException:
            del sys.modules[path]
            raise
    return sys.modules[path]


@contextlib.contextmanager
def _on_path(folder: Path) -> Iterator[None]:
    """Let Python find the file's neighbours for as long as it takes to run it."""
    entry = str(folder.resolve())
    sys.path.insert(0, entry)
    try:
        yield
    finally:
        sys.path.remove(entry)
