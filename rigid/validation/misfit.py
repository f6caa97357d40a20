"""What a prior that does not fit does: which parameter's intervals lose the truth first."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.validation.coverage import LEVELS, Coverage, coverage


@dataclass(frozen=True)
class Effect:
    """One parameter where one constant of the rig lies elsewhere than its prior says.

    - `constant`: label of what was shifted, `by` so many prior sds. - `parameter`.
    - `error`: mean error of the parameter for a shift upwards [posterior sds]; `expected`: that of
      Gaussian laws. - `coverage`: of the 90 % interval.
    """

    constant: str
    by: float
    parameter: str
    error: float
    expected: float
    coverage: Coverage


def effects(used: Sequence[Mapping[str, Any]]) -> tuple[Effect, ...]:
    """List what every shift does to every parameter, least coverage first.

    - `used`: values of rows of a design with a shift.
    """
    constants = dict.fromkeys(v["shifted"]["label"] for v in used if v["shifted"])
    found = []
    for constant in constants:
        mine = [v for v in used if v["shifted"] and v["shifted"]["label"] == constant]
        sign = np.sign([v["shifted"]["by"] for v in mine])
        for parameter in mine[0]["error"]:
            errors = np.array([v["error"][parameter] for v in mine])
            expected = np.array([v["shifted"]["expected"][parameter] for v in mine])
            ranks = np.array([v["ranks"][parameter] for v in mine])
            found.append(
                Effect(
                    constant,
                    float(abs(mine[0]["shifted"]["by"])),
                    parameter,
                    float(np.mean(sign * errors)),
                    float(np.mean(sign * expected)),
                    coverage(ranks, LEVELS[-1]),
                )
            )
    return tuple(sorted(found, key=lambda one: (one.coverage.share, -abs(one.expected))))


def first_for_each(listed: Sequence[Effect]) -> tuple[Effect, ...]:
    """The parameter that each constant hurts most, that constant itself apart."""
    worst: dict[str, Effect] = {}
    for one in listed:
        if one.parameter != one.constant:
            worst.setdefault(one.constant, one)
    return tuple(worst.values())
