"""Hidden things of the simplest shapes: constant, in proportion to a state, with its sign, a drift.

Bumps add up to a straight line as well, but to one among all the curves that they can make, and
are believed the less for it. What is really missing is often straight: a push, a leak, another
area, a zero that wanders.
"""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from rigid.discovery.unmodelled.bumps import Bumps, Target, together

FORMS: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "constant": np.ones_like,
    "proportional": lambda state: state,
    "sign": np.sign,
}
"""Shapes over a state, by the name that a target has for them."""
TURNING = ("speed", "cylinder speed", "load")
"""States that change their sign."""
DRIFT = "proportional"


def straight(found: Bumps) -> Bumps:
    """Straight hidden things that bumps add up to; each is a single trace, per unit of its number.

    A distortion of a sensor in proportion to its reading is its gain, which every fit has.
    """
    return together([*_over_states(found), *_drifts(found)])


def places(found: Bumps, target: Target) -> np.ndarray:
    """Centres, ascending, of the bumps among hidden things that a straight one is made of."""
    mine = [t[:3] == target[:3] and not t.form and t.period is None for t in found.target]
    return np.unique(found.centre[np.array(mine)])


def _over_states(found: Bumps) -> Iterator[Bumps]:
    constant = set()
    for target in dict.fromkeys(found.target):
        if target.variable in ("time", "reading"):
            continue
        for form, shape in FORMS.items():
            if form == "constant" and target.kind in constant:  # the same over every state
                continue
            if form == "sign" and target.variable not in TURNING:
                continue
            yield _summed(found, [target], target._replace(form=form), shape)
        constant.add(target.kind)


def _drifts(found: Bumps) -> Iterator[Bumps]:
    """One slope over the time of every record for all sensors of a quantity."""
    timed = [
        t for t in dict.fromkeys(found.target) if t.equation == "sensor" and t.variable == "time"
    ]
    for kind in dict.fromkeys(t.kind for t in timed):
        mine = [t for t in timed if t.kind == kind]
        yield _summed(found, mine, mine[0]._replace(track=None, form=DRIFT), FORMS[DRIFT])


def _summed(
    found: Bumps,
    parts: list[Target],
    target: Target,
    shape: Callable[[np.ndarray], np.ndarray],
) -> Bumps:
    """The trace of bumps as high as a shape is at their centres."""
    mine = np.flatnonzero([t in parts for t in found.target])
    column = found.columns[:, mine] @ shape(found.centre[mine])
    return Bumps(column[:, None], (target,), np.zeros(1))
