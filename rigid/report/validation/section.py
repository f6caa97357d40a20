"""The section on a validation: what it is on the page, and its content."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rigid.report.content import Content
from rigid.report.section import Kind
from rigid.report.validation import figures
from rigid.validation.alarms import Alarms
from rigid.validation.misfit import Effect
from rigid.validation.tested import Tested

TITLE, ORDER, TEMPLATE = "Validation", 60, "validation.html.j2"


def kind(name: str) -> Kind:
    """The section of one design; others of the same folder stand beside it."""
    title = TITLE if name == "validation" else f"{TITLE}: {name.removeprefix('validation-')}"
    return Kind(name, ORDER, title, TEMPLATE, figures)


@dataclass(frozen=True, eq=False)
class RankShown:
    """Ranks of one quantity as a curve.

    - `name`; `joint`: whether it is of the posterior as a whole; `ok`.
    - `at` (points,); `difference` (points,): share of ranks below less the share expected.
    """

    name: str
    joint: bool
    ok: bool
    at: Float[np.ndarray, " points"]
    difference: Float[np.ndarray, " points"]


@dataclass(frozen=True, eq=False, kw_only=True)
class ValidationContent(Content):
    """The section, complete.

    - `tested`: quantities. - `heads`: of the columns of intervals. - `notes`: sentences.
    - `misfits`; `by`: their shift. - `alarms`: of discovery, None where it was not asked.
    - `shown`: curves; `least`, `greatest` (points,): the band that holds 95 % of sound ones.
    """

    tested: tuple[Tested, ...]
    heads: tuple[str, ...]
    notes: tuple[str, ...]
    misfits: tuple[Effect, ...]
    by: float
    alarms: Alarms | None
    shown: tuple[RankShown, ...]
    least: Float[np.ndarray, " points"]
    greatest: Float[np.ndarray, " points"]
