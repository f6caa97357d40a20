"""Hidden things of the simplest shapes: constant, in proportion to a state, with its sign, a drift.

Bumps add up to a straight line as well, but to one among all the curves that they can make, and
are believed the less for it. What is really missing is often straight: a push, a leak, another
area, a zero that wanders.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, AbstractHidden, Bumps, Inferred, none, together
from rigid.plots.shown import HiddenShown


class Form(NamedTuple):
    """A shape over what something goes by: its values, and its words behind the number."""

    values: Callable[[np.ndarray], np.ndarray]
    words: str


FORMS: Mapping[str, Form] = {
    "constant": Form(np.ones_like, ""),
    "proportional": Form(lambda state: state, " {}"),
    "sign": Form(np.sign, " sgn({})"),
}


@dataclasses.dataclass(frozen=True)
class Straight(AbstractHidden):
    """A hidden thing that bumps add up to.

    - `of`: what the bumps are of, in all records together. - `form`: one of FORMS.
    """

    of: AbstractHidden
    form: str

    sort: ClassVar[str] = "straight"
    order: ClassVar[int] = 5

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:
        """Every form that the sorts before allow; each is one signature, per unit of its number."""
        return together([none(len(fit.local.residual)), *straight(earlier())])

    @property
    def about(self) -> About:
        """What it is."""
        return self.of.about

    def shown(self, found: Inferred) -> HiddenShown:
        """A line over the range of what it goes by."""
        place = places(found.everything, self)
        form = FORMS[self.form]
        curve, number = form.values(place), float(found.mean[0])
        line, sd = number * curve, float(found.sd[0]) * np.abs(curve)
        words = f"{number:.3g}{form.words.format(self.about.over.symbol)}"
        return self.drawn(place, line, sd, line, words)


def straight(found: Bumps) -> Iterator[Bumps]:
    """Signatures of the straight things that bumps add up to.

    What is constant is the same over every state.
    """
    constant: set[str] = set()
    for target in dict.fromkeys(t.pooled or t for t in found.target):
        for form in target.forms:
            if form == "constant" and target.about.name in constant:
                continue
            constant |= {target.about.name} if form == "constant" else set()
            mine = _parts(found, target)
            column = found.columns[:, mine] @ FORMS[form].values(found.centre[mine])
            yield Bumps(column[:, None], (Straight(target, form),), np.zeros(1))


def places(found: Bumps, target: Straight) -> Float[np.ndarray, " m"]:
    """Centres, ascending, of the bumps among hidden things that a straight one is made of."""
    return np.unique(found.centre[_parts(found, target.of)])


def _parts(found: Bumps, target: AbstractHidden) -> np.ndarray:
    """Numbers of the bumps that are of a hidden thing, in one record or in all."""
    return np.flatnonzero([(t.pooled or t) == target for t in found.target])
