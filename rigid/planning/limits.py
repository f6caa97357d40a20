"""What sensors may be made to read and what may be set, and what a candidate would not keep."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from rigid.likelihood.parameters import Parameter
from rigid.likelihood.problem import Problem
from rigid.planning.change import DRIVES, FLOW, Change
from rigid.spec import Spec


@dataclasses.dataclass(frozen=True)
class Beyond:
    """A limit that a candidate would not keep: of what, what is reached, and what may be."""

    what: str
    reached: float
    limit: float


def limits_of(spec: Spec, change: Change) -> dict[str, float]:
    """Greatest reading by quantity: the sensors' ranges, within what the spec allows."""
    most = {} if spec.plan is None else {str(q): end for q, end in spec.plan.limits.items()}
    ends = {
        quantity: sheet.range[1] * change.ranges.get(quantity, 1.0)
        for quantity, sheet in spec.sensors.stated.items()
    }
    kept = {quantity: min(end, most.get(quantity, np.inf)) for quantity, end in ends.items()}
    return {**kept, "flow fraction": 1.0}


def with_settings(
    read: Mapping[str, float],
    problem: Problem,
    change: Change,
    own: Sequence[tuple[Parameter, float]],
) -> dict[str, float]:
    """Return the greatest readings by quantity, and what is set for them.

    - `problem`: in which the record is the candidate. - `own`: the candidate's own numbers with
      their values in SI.
    """
    out = dict(read) | driven(problem, change)
    for what, base in (("flow fraction", FLOW), ("load", "preload")):
        found = [value for one, value in own if one.base == base]
        if found:
            out[what] = max(*found, out.get(what, 0.0))
    return out


def driven(problem: Problem, change: Change) -> dict[str, float]:
    """Greatest force and command in the candidate, where it has any."""
    given = [t.given for t in problem.tracks if t.name == change.like and t.given is not None]
    found = {}
    for name in DRIVES:
        series = [one for one in (getattr(g, name) for g in given) if one is not None]
        if series:
            found[name] = max(float(np.abs(np.asarray(one)).max()) for one in series)
    return found


def beyond(greatest: Sequence[Mapping[str, float]], limits: Mapping[str, float]) -> Beyond | None:
    """Return the first limit that half of the points do not keep.

    - `greatest`: what is read and set at each point, by what it is.
    """
    for what in greatest[0]:
        reached = float(np.median([one[what] for one in greatest]))
        if reached > limits.get(what, np.inf):
            return Beyond(what, reached, limits[what])
    return None
