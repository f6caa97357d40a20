"""What acts on the rig, one physical cause a file.

Every effect that a module of this folder defines is in the catalogue: adding one is adding its
file.
"""

import inspect
from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import ParameterInfo, PriorDescription

ORDER = (
    "load-cell-spring",
    "oil-compressibility",
    "viscous-friction",
    "pump-curve",
    "coulomb-friction",
    "stribeck-friction",
    "lugre-friction",
    "frequency-dependent-friction",
    "pressure-dependent-friction",
    "return-spring",
    "effective-area",
    "piston-leakage",
    "entrained-air",
    "hose-pressure-drop",
    "pump-stage-switch",
    "pump-slip",
    "pump-ripple",
    "valve-event",
    "load-cell-stiffening",
    "free-root-plate",
    "seating-slack",
    "stroke-sensor-lag",
    "load-cell-drift",
    "clock-offset",
    "constant-force",
    "direction-dependent-viscosity",
    "shut-valve-leakage",
    "pressure-gauge-lag",
    "load-cell-creep",
    "load-cell-hysteresis",
    "temperature-drift",
    "accelerometer-resonance",
    "gradual-release",
    "mains-pickup",
    "sample-averaging",
)
"""In which the catalogue lists what came with it; other effects follow by name."""


def _defined() -> Iterator[type[AbstractEffect]]:
    """Every effect of this folder that can act; `__main__` writes the page and defines none."""
    for module in iter_modules(__path__, f"{__name__}."):
        if module.name.endswith("__main__"):
            continue
        for member in vars(import_module(module.name)).values():
            if (
                isinstance(member, type)
                and issubclass(member, AbstractEffect)
                and member.__module__ == module.name
                and not inspect.isabstract(member)
            ):
                yield member


def _rank(effect: type[AbstractEffect]) -> tuple[int, str]:
    known = effect.name in ORDER
    return ORDER.index(effect.name) if known else len(ORDER), effect.name


CATALOGUE: dict[str, type[AbstractEffect]] = {
    effect.name: effect for effect in sorted(_defined(), key=_rank)
}

__all__ = [
    "CATALOGUE",
    "AbstractEffect",
    "Action",
    "ParameterInfo",
    "PriorDescription",
    "State",
]
