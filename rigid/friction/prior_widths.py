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


def sized(prior: AbstractPrior, factor: float) -> AbstractPrior:
    """Return the prior of `factor` times the quantity."""
    if isinstance(prior, Lognormal):
        return Lognormal(prior.median * factor, prior.factor)
    if isinstance(prior, Normal):
        return Normal(prior.mean * factor, prior.sd * factor)
    if isinstance(prior, TruncatedNormal):
        return TruncatedNormal(*(factor * v for v in (prior.mean, prior.sd, prior.low, prior.high)))
    if isinstance(prior, Uniform | LogUniform):
        return dataclasses.replace(prior, low=prior.low * factor, high=prior.high * factor)
    return prior


def spread(prior: AbstractPrior, factor: float) -> AbstractPrior:
    """Return the prior with `factor` times the width: of the logarithm, of a lognormal prior.

    Priors between two bounds stay as they are.
    """
    if isinstance(prior, Lognormal):
        return Lognormal(prior.median, prior.factor**factor)
    if isinstance(prior, Normal):
        return Normal(prior.mean, prior.sd * factor)
    return prior


VARIANTS: dict[str, Callable[[AbstractPrior], AbstractPrior]] = {
    AS_STATED: lambda prior: prior,
    "3 times the size": lambda prior: sized(prior, SIZE),
    "a third of the size": lambda prior: sized(prior, 1.0 / SIZE),
    "twice the width": lambda prior: spread(prior, WIDTH),
    "half the width": lambda prior: spread(prior, 1.0 / WIDTH),
}
"""What is done to the prior of every amplitude, by name."""
