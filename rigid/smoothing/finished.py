"""What is held of a field test once its files are written: all that report and summary need."""

from collections.abc import Mapping
from dataclasses import dataclass

from rigid.inference.reference_check import SolverCheck
from rigid.likelihood.set_aside import Aside
from rigid.plots.figure import Illustration
from rigid.smoothing.budget import Line
from rigid.smoothing.events import Fall, Turn


@dataclass(frozen=True)
class Finished:
    """A field test without its series.

    - `name`; `places`: cylinders or joints at which something happened or was sought.
    - `budget`, `falls`, `turns`: as found.
    - `gaps`: root mean square of the residuals over noise and rounding, by "load of name,cylinder".
    - `sha256`: of the files, by label. - `figures`: as drawn, a few hundred points a curve.
    - `aside`: readings that were set aside under any law. - `kind`: of the records.
    - `solver`: the smoother's steps held against diffrax, by law and record.
    """

    name: str
    places: tuple[str, ...]
    budget: tuple[Line, ...]
    falls: tuple[Fall, ...]
    turns: tuple[Turn, ...]
    gaps: Mapping[str, float]
    sha256: Mapping[str, str]
    figures: tuple[Illustration, ...]
    aside: tuple[Aside, ...]
    kind: str
    solver: tuple[SolverCheck, ...] = ()
