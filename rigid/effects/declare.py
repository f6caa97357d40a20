"""How an effect declares its parameters: name, unit, meaning and what is believed of them."""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypedDict, Unpack

import equinox as eqx
import jax.numpy as jnp


@dataclasses.dataclass(frozen=True)
class PriorDescription:
    """A prior in words and numbers: the name of its law and the law's arguments."""

    law: str
    arguments: Mapping[str, float]


def lognormal(median: float, factor: float) -> PriorDescription:
    """Describe a lognormal prior: one sd is a factor up or down from the median."""
    return PriorDescription("lognormal", {"median": median, "factor": factor})


def any_size(usual: float) -> PriorDescription:
    """Describe the prior of something whose order of magnitude is not known: one sd is a decade.

    - `usual`: what rigs of its kind have where it matters to them, one sd above the median. Records
      may show a hundredth of that, and a prior that forbids it makes them name something else.
    """
    return lognormal(usual / 10.0, 10.0)


def either_sign(usual: float) -> PriorDescription:
    """Describe the prior of something whose sign and order of magnitude are not known.

    - `usual`: what rigs of its kind have where it matters to them, one sd either way.
    """
    return PriorDescription("either_sign", {"usual": usual})


def normal(mean: float, sd: float) -> PriorDescription:
    """Describe a Gaussian prior."""
    return PriorDescription("normal", {"mean": mean, "sd": sd})


def truncated_normal(mean: float, sd: float, low: float, high: float) -> PriorDescription:
    """Describe a Gaussian prior that is cut to between `low` and `high`."""
    return PriorDescription("truncated_normal", {"mean": mean, "sd": sd, "low": low, "high": high})


def uniform(low: float, high: float) -> PriorDescription:
    """Describe a prior under which all values between `low` and `high` are alike."""
    return PriorDescription("uniform", {"low": low, "high": high})


def loguniform(low: float, high: float) -> PriorDescription:
    """Describe a prior under which all orders of magnitude between `low` and `high` are alike."""
    return PriorDescription("loguniform", {"low": low, "high": high})


def fixed(value: float) -> PriorDescription:
    """Describe a constant that is taken as known."""
    return PriorDescription("fixed", {"value": value})


@dataclasses.dataclass(frozen=True)
class ParameterInfo:
    """All there is to know of one parameter of an effect.

    - `name`: its name in specs and results; an element of a vector reads `name[i]`.
    - `symbol`: TeX, as the paper writes it where it does.
    - `unit`: SI.
    - `priors`: one a priori law for each element.
    - `meaning`: in words, without an article: "bulk modulus of the oil".
    - `absent`: the value at which the effect is not there; None where there is no such value.
    - `part_of`: name of a sum that records know far better than its parts, those of other effects
      included; None where there is none.
    - `place`: joint of a machine that it is the number of; empty where it belongs to none.
    - `sized`: whether its priors go with what is usual in a machine.
    """

    name: str
    symbol: str
    unit: str
    priors: tuple[PriorDescription, ...]
    meaning: str = ""
    absent: float | None = None
    part_of: str | None = None
    place: str = ""
    sized: bool = True

    @property
    def labels(self) -> tuple[str, ...]:
        """Flat names, one for each element."""
        at = f"[{self.place}]" if self.place else ""
        if len(self.priors) == 1:
            return (f"{self.name}{at}",)
        return tuple(f"{self.name}[{i + 1}]{at}" for i in range(len(self.priors)))


class More(TypedDict, total=False):
    """What need not be said of a parameter, as in `ParameterInfo`."""

    meaning: str
    absent: float | None
    part_of: str | None
    sized: bool


def parameter(
    name: str, symbol: str, unit: str, *priors: PriorDescription, **more: Unpack[More]
) -> Any:
    """Declare a field of an effect as a parameter; several priors make it a vector."""
    info = ParameterInfo(name, symbol, unit, priors, **more)
    return eqx.field(metadata={"parameter": info}, converter=jnp.asarray)


STEADY_FRICTION = "mu(0)"
"""The friction of steady running; every friction proportional to the speed has its part in it."""
