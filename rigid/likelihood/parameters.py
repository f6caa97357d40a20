"""The list of uncertain numbers of a fit: labels, laws, and the map from z to SI values."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from rigid.io.errors import InputError
from rigid.likelihood.priors import AbstractLaw
from rigid.spec.sentences import unknown

Value = TypeVar("Value")


class Parameter(eqx.Module):
    """One uncertain number.

    - `label`: its flat name, `k_LC`, `kappa[free-run-2,A]`.
    - `symbol`: TeX. - `unit`: SI. - `law`: its prior.
    - `varies`: whether it is one of several values of a number that varies by kind, cylinder or
      record.
    """

    label: str = eqx.field(static=True)
    symbol: str = eqx.field(static=True)
    unit: str = eqx.field(static=True)
    law: AbstractLaw
    varies: bool = eqx.field(static=True, default=False)

    @property
    def base(self) -> str:
        """Name without the record, cylinder or kind it belongs to."""
        return self.label.split("[")[0]


class Parameters(eqx.Module):
    """All uncertain numbers of a fit, in the order of the sampler's vector z; known ones apart."""

    sampled: tuple[Parameter, ...]
    known: tuple[Parameter, ...]

    @property
    def size(self) -> int:
        """Length of z."""
        return len(self.sampled)

    @property
    def labels(self) -> tuple[str, ...]:
        """Flat names of the entries of z."""
        return tuple(p.label for p in self.sampled)

    def index(self, label: str) -> int:
        """Place of a label in z."""
        return self.labels.index(label)

    def values(self, z: Array) -> dict[str, Array]:
        """Map z of shape (walkers, size) to SI values of shape (walkers,) by label."""
        none = jnp.zeros(z.shape[0])
        sampled = {p.label: p.law.from_standard(z[:, i]) for i, p in enumerate(self.sampled)}
        return sampled | {p.label: p.law.from_standard(none) for p in self.known}


def collect(parameters: Iterable[Parameter]) -> Parameters:
    """Part the parameters into those that are sampled and those that are known."""
    listed = tuple(parameters)
    return Parameters(
        tuple(p for p in listed if not p.law.known), tuple(p for p in listed if p.law.known)
    )


def scoped(values: Mapping[str, Value], scope: Sequence[str]) -> dict[str, Value]:
    """Values as one record sees them: `mu[free-run]` becomes `mu` where "free-run" is in `scope`.

    - `scope`: the record's kind, its cylinder and "name,cylinder".
    """
    seen = dict(values)
    for label, value in values.items():
        base, _, rest = label.rpartition("[")
        if base and rest[:-1] in scope:
            seen[base] = value
    return seen


def require_known(given: Iterable[str], allowed: Iterable[str], where: str) -> None:
    """Raise InputError for names that nothing answers to, with the nearest known one."""
    names = sorted(set(allowed))
    for name in given:
        if name not in names:
            raise InputError(f"{where}: {unknown('name', name, names)}")
