"""How far the solver is from diffrax at the truths of campaigns.

Ranks cannot see it: what fits a campaign solves as what has drawn it. The truth of a campaign drawn
from the prior is a draw of that campaign's posterior, so that errors there are those of answers.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rigid.inference.reference_check import LEAST_ENDED, MOST_STEPS, solved_again
from rigid.inference.summary import Check
from rigid.likelihood.problem import Problem
from rigid.validation.tested import seldom


def solved(problem: Problem, truth: np.ndarray) -> dict[str, Any] | None:
    """Solve a campaign again at its truth (size,); None where there is nothing to solve.

    - `problem`: with the campaign's readings.

    Returns what a row says: `ended`, whether diffrax came to its end; `bars` of the worst reading
    in `sensor`, in what it is `per`; `difference` of the log-posterior. These are None without end.
    """
    check = solved_again(problem, truth[None])
    if check is None:
        return None
    worst = check.worst
    if worst is None or check.differences is None:
        return {"ended": False, "bars": None, "per": None, "sensor": None, "difference": None}
    return {
        "ended": True,
        "bars": float(f"{worst.bars:.3g}"),
        "per": worst.per,
        "sensor": f"{worst.quantity} of {worst.record}",
        "difference": float(f"{check.differences[0]:.3g}"),
    }


def seldom_off(used: Sequence[Mapping[str, Any]]) -> Check | None:
    """Check in how many campaigns the solver's error matters; None for rows that do not say.

    - `used`: values of rows.
    """
    told = [one for value in used if (one := value.get("solver")) is not None]
    ended = [one for one in told if one["ended"]]
    if not ended:
        return Check("solver", False, _no_end(len(told))) if told else None
    worst = max(ended, key=lambda one: one["bars"])
    many = sum(one["bars"] > MOST_STEPS for one in ended)
    unit = "step" if worst["per"] == "step" else "noise sd"
    moved = np.abs([one["difference"] for one in ended])
    says = (
        f"truths of {len(ended)} campaigns solved again by diffrax: readings are off by "
        f"{worst['bars']:.2g} {unit}s of the sensor at most ({worst['sensor']}), by more than "
        f"{MOST_STEPS:g} in {many}; the log-posterior by {np.median(moved):.2g} in half of them, "
        f"{np.max(moved):.2g} at most"
    )
    if len(ended) < len(told):
        says = f"{says}; {_no_end(len(told) - len(ended))}"
    if len(ended) < LEAST_ENDED * len(told):
        return Check("solver", False, says)
    if seldom(many, len(ended)):
        return Check("solver", True, says)
    return Check("solver", False, f'{says}; state [solve] method = "diffrax"')


def _no_end(many: int) -> str:
    return f"diffrax did not come to its end in {many}"
