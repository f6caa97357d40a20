"""Hidden things that no effect of the catalogue stands for; every sort is one file here."""

import importlib
import inspect
import pkgutil

from rigid.discovery.unmodelled.base import AbstractHidden


def _found() -> dict[str, type[AbstractHidden]]:
    """Sorts in the files of this folder, by name, in their order."""
    names = [module.name for module in pkgutil.iter_modules(__path__)]
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    classes = {
        one
        for module in modules
        for one in vars(module).values()
        if inspect.isclass(one) and issubclass(one, AbstractHidden) and not inspect.isabstract(one)
    }
    return {one.sort: one for one in sorted(classes, key=lambda one: (one.order, one.sort))}


SORTS = _found()
