"""Priors, each a map from the standard normal to its quantity.

A parameter that is `from_standard(z)` with z standard normal has that prior; the sampler works
on z, where every prior is the same.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jax.scipy.special import ndtr, ndtri
from jax.typing import ArrayLike

from rigid.io.errors import InputError

SLOPE = 0.05
"""Of `EitherSign` at 0, over that of its cube at 1/sqrt(3)."""


def argument() -> Any:
    """Declare an argument of a prior; an array, so that programs do not depend on its value."""
    return eqx.field(converter=jnp.asarray)


class AbstractPrior(eqx.Module):
    """A prior; `name` is its key in a spec, its fields are the arguments there."""

    name: eqx.AbstractClassVar[str]

    @abstractmethod
    def from_standard(self, z: ArrayLike) -> Array:
        """Map standard normal `z` to the quantity, monotonically, elementwise."""

    @property
    def known(self) -> bool:
        """Whether the prior is a single value, so that nothing is sampled."""
        return False


class Lognormal(AbstractPrior):
    """One standard deviation is a `factor` up or down from the `median`."""

    median: Array = argument()
    factor: Array = argument()
    name: ClassVar[str] = "lognormal"

    def __check_init__(self):
        """Refuse what is no lognormal prior."""
        if not (self.factor > 1.0 and self.median != 0.0):
            raise InputError("lognormal needs a factor above 1 and a median other than 0")

    def from_standard(self, z: ArrayLike) -> Array:
        """Return median * factor^z; a negative median gives negative values."""
        return self.median * jnp.exp(jnp.log(self.factor) * z)


class Normal(AbstractPrior):
    """Gaussian of given `mean` and `sd`; an sd of 0 is a known value."""

    mean: Array = argument()
    sd: Array = argument()
    name: ClassVar[str] = "normal"

    def __check_init__(self):
        """Refuse a negative width."""
        if self.sd < 0.0:
            raise InputError("normal needs an sd of 0 or more")

    def from_standard(self, z: ArrayLike) -> Array:
        """Return mean + sd z."""
        return self.mean + self.sd * z

    @property
    def known(self) -> bool:
        """Whether the width is 0."""
        return bool(self.sd == 0.0)


class TruncatedNormal(AbstractPrior):
    """Gaussian of `mean` and `sd`, cut to between `low` and `high`."""

    mean: Array = argument()
    sd: Array = argument()
    low: Array = argument()
    high: Array = argument()
    name: ClassVar[str] = "truncated_normal"

    def __check_init__(self):
        """Refuse an empty stretch."""
        if not (self.low < self.high and self.sd > 0.0):
            raise InputError("truncated_normal needs low < high and an sd above 0")

    def from_standard(self, z: ArrayLike) -> Array:
        """Map through both distribution functions."""
        low, high = ndtr((self.low - self.mean) / self.sd), ndtr((self.high - self.mean) / self.sd)
        value = self.mean + self.sd * ndtri(low + (high - low) * ndtr(z))
        return jnp.clip(value, self.low, self.high)


class Uniform(AbstractPrior):
    """All values between `low` and `high` alike."""

    low: Array = argument()
    high: Array = argument()
    name: ClassVar[str] = "uniform"

    def __check_init__(self):
        """Refuse an empty stretch."""
        if not self.low < self.high:
            raise InputError("uniform needs low < high")

    def from_standard(self, z: ArrayLike) -> Array:
        """Map through the normal distribution function."""
        return self.low + (self.high - self.low) * ndtr(z)


class LogUniform(AbstractPrior):
    """All orders of magnitude between `low` and `high` alike."""

    low: Array = argument()
    high: Array = argument()
    name: ClassVar[str] = "loguniform"

    def __check_init__(self):
        """Refuse an empty or non-positive stretch."""
        if not 0.0 < self.low < self.high:
            raise InputError("loguniform needs 0 < low < high")

    def from_standard(self, z: ArrayLike) -> Array:
        """Map through the normal distribution function, in the logarithm."""
        return self.low * jnp.exp(jnp.log(self.high / self.low) * ndtr(z))


class EitherSign(AbstractPrior):
    """A size whose sign and order of magnitude are not known; one sd is `usual`, either way.

    It is usual z^3, with a slope at 0 so that it can be differentiated there: a tenth of `usual`
    is as far from 0 as 0.43 sd, a hundredth as 0.14 sd.
    """

    usual: Array = argument()
    name: ClassVar[str] = "either_sign"

    def __check_init__(self):
        """Refuse what has no size."""
        if not self.usual > 0.0:
            raise InputError("either_sign needs a usual size above 0")

    def from_standard(self, z: ArrayLike) -> Array:
        """Return usual (z^3 + e z)/(1 + e)."""
        z = jnp.asarray(z)
        return self.usual * (z**3 + SLOPE * z) / (1.0 + SLOPE)


class Fixed(AbstractPrior):
    """A known value."""

    value: Array = argument()
    name: ClassVar[str] = "fixed"

    def from_standard(self, z: ArrayLike) -> Array:
        """Return the value, whatever z."""
        return self.value + 0.0 * z

    @property
    def known(self) -> bool:
        """Return True."""
        return True


LAWS: dict[str, type[AbstractPrior]] = {
    prior.name: prior
    for prior in (Lognormal, Normal, TruncatedNormal, Uniform, LogUniform, EitherSign, Fixed)
}


def make_prior(name: str, arguments: Mapping[str, float], where: str) -> AbstractPrior:
    """Make a prior from its name and arguments; `where` heads the message when they do not fit.

    Raises InputError for an unknown prior, wrong arguments or values that make no prior.
    """
    if name not in LAWS:
        raise InputError(f"{where}: unknown prior '{name}'; known are {', '.join(LAWS)}")
    prior = LAWS[name]
    wanted = [f for f in prior.__dataclass_fields__ if f != "name"]
    if set(arguments) != set(wanted):
        given = ", ".join(arguments) or "nothing"
        raise InputError(f"{where}: {name} takes {', '.join(wanted)}; given was {given}")
    try:
        exact: dict[str, Any] = {key: float(value) for key, value in arguments.items()}
        return prior(**exact)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
