"""A story: causes and constants with their priors that may stand behind the printed numbers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from rigid.effects.declare import PriorDescription
from rigid.likelihood.priors import AbstractPrior, make_prior
from rigid.published.quantities import Effects, Response, Values, response

PRIOR_SETS = ("catalogue", "indifferent")
"""The two stated priors: the laws of the catalogue and of the paper; all orders alike."""


@dataclass(frozen=True)
class Quantity:
    """A number that a story leaves open.

    - `label`, `symbol` (TeX), `unit`. - `laws`: its prior in each of PRIOR_SETS.
    """

    label: str
    symbol: str
    unit: str
    laws: Mapping[str, AbstractPrior]


def quantity(
    label: str, symbol: str, unit: str, known: PriorDescription, wide: PriorDescription
) -> Quantity:
    """A number with what the catalogue knows of it, and with the wide prior."""
    made = [make_prior(one.law, one.arguments, label) for one in (known, wide)]
    return Quantity(label, symbol, unit, dict(zip(PRIOR_SETS, made, strict=True)))


@dataclass(frozen=True)
class Story:
    """One account of the release.

    - `key`, `title`: in files, in words. - `effects`: what acts in the release.
    - `quantities`: what it leaves open beside the constants of the rig.
    - `assumes`: what it rests on. - `decides`: the measurement that would decide.
    - `respond`: values by label -> motion after the release.
    - `slow`: values -> friction coefficient of steady running [N s/m].
    """

    key: str
    title: str
    effects: Effects
    quantities: tuple[Quantity, ...]
    assumes: str
    decides: str
    respond: Callable[["Story", Values], Response]
    slow: Callable[[Values], np.ndarray]


@dataclass(frozen=True)
class Cause:
    """One account of S p / v in free running: a force or a coefficient common to both cylinders.

    - `parameter`, `symbol`, `unit`: of the common number; empty where it has none.
    - `prior`: median and factor of its lognormal prior by prior set; a factor of 1 where the number
      is the friction of the release.
    - `spread`: factor (1 sd) by which a cylinder differs from the common number, by prior set.
    - `speed`: 1 where the printed S p / v falls with the speed (a force), else 0 (a coefficient).
    - `scale`: printed coefficient per unit of the number (times speed if `speed`).
    """

    key: str
    title: str
    parameter: str
    symbol: str
    unit: str
    prior: Mapping[str, tuple[float, float]]
    spread: Mapping[str, float]
    speed: int
    scale: float
    assumes: str
    decides: str


def plain(story: Story, values: Values) -> Response:
    """The release of one rig with the story's effects."""
    return response(story.effects, values)
