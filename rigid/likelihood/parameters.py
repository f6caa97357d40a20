"""The list of uncertain numbers of a fit: labels, laws, and the map from z to SI values."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from rigid.io.errors import InputError
from rigid.likelihood.priors import AbstractPrior
from rigid.spec.sentences import unknown

Value = TypeVar("Value")


class Parameter(eqx.Module):
    """One uncertain number.

    - `label`: its flat name, `k_LC`, `kappa[free-run-2,A]`. - `symbol`: TeX. - `unit`: SI.
    - `prior`. - `varies`: whether it is one of several values of a number that varies by
      kind, cylinder or record.
    - `name`: without what it belongs to, `kappa`; left out: the label. - `places`: what stands in
      the label's brackets, in their order. - `number`: which of several of one name, of an effect.
    - `record`, `cylinder`, `kind`: what it belongs to; "" where it belongs to none. With a record
      but no cylinder it belongs to all cylinders of that record.

    The label is made of the rest, and nobody reads it again.
    """

    label: str = eqx.field(static=True)
    symbol: str = eqx.field(static=True)
    unit: str = eqx.field(static=True)
    prior: AbstractPrior
    varies: bool = eqx.field(static=True, default=False)
    name: str = eqx.field(static=True, default="")
    places: tuple[str, ...] = eqx.field(static=True, default=())
    number: str = eqx.field(static=True, default="")
    record: str = eqx.field(static=True, default="")
    cylinder: str = eqx.field(static=True, default="")
    kind: str = eqx.field(static=True, default="")

    @property
    def base(self) -> str:
        """Name without the record, cylinder or kind it belongs to."""
        return self.name or self.label

    @property
    def view(self) -> str:
        """Label of the kind, the cylinder or the record in which it has this value."""
        return self.kind or ",".join(word for word in (self.record, self.cylinder) if word)

    @property
    def numbered_symbol(self) -> str:
        """TeX with the number of a branch in place of its index."""
        return self.symbol.replace("_i", f"_{self.number}") if self.number else self.symbol

    def is_own(self, record: str, cylinder: str) -> bool:
        """Whether it belongs to a record, as measured on a cylinder, and not to all records."""
        return self.record == record and self.cylinder in ("", cylinder)


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
        sampled = {p.label: p.prior.from_standard(z[:, i]) for i, p in enumerate(self.sampled)}
        return sampled | {p.label: p.prior.from_standard(none) for p in self.known}


def collect(parameters: Iterable[Parameter]) -> Parameters:
    """Part the parameters into those that are sampled and those that are known."""
    listed = tuple(parameters)
    return Parameters(
        tuple(p for p in listed if not p.prior.known), tuple(p for p in listed if p.prior.known)
    )


class Scoped(Mapping[str, Value]):
    """Values as one record sees them: `mu` is `mu[free-run]` where "free-run" is in its scope.

    - `values`: by label. - `scope`: the record's kind, its cylinder and "name,cylinder".
    """

    def __init__(self, values: Mapping[str, Value], scope: Sequence[str]):
        self._values, self._scope = values, scope

    def __getitem__(self, name: str) -> Value:
        own = (f"{name}[{place}]" for place in self._scope)
        return self._values[next((label for label in own if label in self._values), name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)


def require_known(given: Iterable[str], allowed: Iterable[str], where: str) -> None:
    """Raise InputError for all names that nothing answers to, each with the nearest known one."""
    names = sorted(set(allowed))
    if says := [f"{where}: {unknown('name', name, names)}" for name in given if name not in names]:
        raise InputError("\n".join(says))
