"""Priors of amplitudes made larger, smaller, wider, narrower: what of the odds is the prior's."""

import dataclasses
from collections.abc import Callable

from rigid.likelihood.priors import (
    AbstractPrior,
    Lognormal,
    LogUniform,
    Normal,
    TruncatedNormal,
    Uniform,
)

SIZE, WIDTH = 3.0, 2.0
AS_STATED = "as stated"


def sized(law: AbstractPrior, factor: float) -> AbstractPrior:
    """Return the prior of `factor` times the quantity."""
    if isinstance(law, Lognormal):
        return Lognormal(law.median * factor, law.factor)
    if isinstance(law, Normal):
        return Normal(law.mean * factor, law.sd * factor)
    if isinstance(law, TruncatedNormal):
        return TruncatedNormal(*(factor * v for v in (law.mean, law.sd, law.low, law.high)))
    if isinstance(law, Uniform | LogUniform):
        return dataclasses.replace(law, low=law.low * factor, high=law.high * factor)
    return law


def spread(law: AbstractPrior, factor: float) -> AbstractPrior:
    """Return the prior with `factor` times the width: of the logarithm, of a lognormal law.

    Laws between two bounds stay as they are.
    """
    if isinstance(law, Lognormal):
        return Lognormal(law.median, law.factor**factor)
    if isinstance(law, Normal):
        return Normal(law.mean, law.sd * factor)
    return law


VARIANTS: dict[str, Callable[[AbstractPrior], AbstractPrior]] = {
    AS_STATED: lambda law: law,
    "3 times the size": lambda law: sized(law, SIZE),
    "a third of the size": lambda law: sized(law, 1.0 / SIZE),
    "twice the width": lambda law: spread(law, WIDTH),
    "half the width": lambda law: spread(law, 1.0 / WIDTH),
}
"""What is done to the prior of every amplitude, by name."""
