"""Laws that exclude one another in one program, each in lanes of its own.

Laws of dry friction differ in how a bristle slides; no rig has two of them. With one bristle that
each lane moves by the law whose turn it is there, one program serves all of them.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any, ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import ParameterInfo, fixed
from rigid.io.structure import MADE
from rigid.kinds import KINDS

ALONE = (
    "root",
    "rates",
    "sense",
    "delays",
    "strap",
    "averaging",
    "lines",
    "friction",
)
"""What an effect may do beside pushing; those that share a state do none of it."""


class AbstractOneOf(AbstractEffect):
    """One of several laws with a state each, of which only one is needed.

    - `laws`: of which `turns` (walkers,) each say whose turn it is: 1, and 0 for all others.
    - `members`: their classes.
    """

    laws: tuple[AbstractEffect, ...]
    turns: tuple[Array, ...]

    members: ClassVar[tuple[type[AbstractEffect], ...]] = ()

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return what the law does whose turn it is."""
        total = [jnp.zeros(())] * len(Action()[:-1])
        rates = [jnp.zeros(())] * len(own)
        for law, turn in zip(self.laws, self.turns, strict=True):
            action = law(state, own)
            total = [a + turn * b for a, b in zip(total, action[:-1], strict=True)]
            rates = [a + turn * b for a, b in zip(rates, action.rates, strict=True)]
        return Action(*total, rates=tuple(rates))

    @classmethod
    def parameters(cls) -> tuple[ParameterInfo, ...]:
        """Those of all laws, what they share once, and whose turn it is."""
        infos = {info.labels: info for law in cls.members for info in law.parameters()}
        turns = (ParameterInfo(turn_of(law), "", "1", (fixed(0.0),)) for law in cls.members)
        return (*infos.values(), *turns)

    @classmethod
    def build(cls, values: Mapping[str, ArrayLike]) -> "AbstractOneOf":
        """Make it from flat values."""
        made: Any = cls  # concrete: `one_of` has given it its name
        laws = tuple(law.build(values) for law in cls.members)
        return made(laws, tuple(jnp.asarray(values[turn_of(law)]) for law in cls.members))

    @classmethod
    def acts_in(cls, kind: str) -> bool:
        """Whether the laws act in records of a kind."""
        return cls.members[0].acts_in(kind)


def turn_of(law: type[AbstractEffect]) -> str:
    """Label of the number that says whether it is the turn of a law."""
    return f"turn[{law.name}]"


@cache
def one_of(members: tuple[type[AbstractEffect], ...]) -> type[AbstractEffect]:
    """Return an effect that is one of several; one class for the same ones."""
    first = members[0]
    own: dict[str, Any] = {
        "__module__": __name__,
        MADE: (one_of, (members,)),
        "members": members,
        "name": " or ".join(law.name for law in members),
        "equation": first.equation,
        "source": "; ".join(law.source for law in members),
        "scales": first.scales,
        "bristle": first.bristle,
        "place": first.place,
    }
    made: Any = type(first)  # what makes such classes
    return made("OneOf", (AbstractOneOf,), own)


def sharing(
    effects: Iterable[type[AbstractEffect]],
) -> Iterator[tuple[type[AbstractEffect], ...]]:
    """Part effects with states into those that can take turns with one state."""
    parts: dict[tuple, list[type[AbstractEffect]]] = {}
    for effect in effects:
        alone = all(getattr(effect, n) is getattr(AbstractEffect, n) for n in ALONE)
        kinds = tuple(kind for kind in KINDS if effect.acts_in(kind))
        alike = (effect.bristle, effect.scales, effect.equation, effect.place, kinds)
        parts.setdefault(alike if effect.bristle and alone else (effect,), []).append(effect)
    return map(tuple, parts.values())
