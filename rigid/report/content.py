"""All that the section on a calibration shows, as values that can be printed and saved.

SI units throughout, unless a field names a unit. None stands for "not available".
What the figures show is defined beside the plots, in `rigid.plots.shown`.
"""

from dataclasses import dataclass

from rigid.inference.alternatives import Alternative
from rigid.plots.shown import ChannelFit, Draws, FrictionCurve, Roots, Trace

__all__ = [
    "Alternative",
    "CalibrationContent",
    "ChannelFit",
    "Check",
    "Draws",
    "FrictionCurve",
    "KeyNumber",
    "ModeRow",
    "ParameterRow",
    "ProductRow",
    "Provenance",
    "Published",
    "RecordNote",
    "Roots",
    "Trace",
]


@dataclass(frozen=True)
class Published:
    """A value somebody printed before, and where: ("6e7", "paper, eq. (16)")."""

    value: float
    place: str


@dataclass(frozen=True)
class Check:
    """A condition on the result: what it is called, whether it holds, what was found."""

    name: str
    ok: bool
    says: str


@dataclass(frozen=True)
class KeyNumber:
    """One of the few numbers people come for.

    - label: in words ("stiffness of the load-cell end"); symbol: TeX without dollar signs
    - reading: one sentence on what it means; left empty, the page compares with `published`
    """

    label: str
    symbol: str
    unit: str
    median: float
    sd: float
    q05: float
    q95: float
    published: tuple[Published, ...] = ()
    reading: str = ""


@dataclass(frozen=True)
class ParameterRow:
    """A parameter, prior beside posterior.

    - name: as in summary.csv, e.g. kappa[free-run-2,A]
    - informed: 1 - posterior sd / prior sd on the standard scale; 0 if only the prior speaks
    """

    name: str
    symbol: str
    unit: str
    prior_median: float
    prior_q05: float
    prior_q95: float
    median: float
    mean: float
    sd: float
    q05: float
    q95: float
    ess_bulk: float | None
    ess_tail: float | None
    r_hat: float | None
    informed: float | None
    published: tuple[Published, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class ProductRow:
    """A combination of parameters that the records identify better than its parts."""

    name: str
    symbol: str
    unit: str
    median: float
    sd: float
    q05: float
    q95: float
    why: str = ""


@dataclass(frozen=True)
class ModeRow:
    """A mode of the posterior; error is the Monte Carlo error of its weight.

    - values: (symbol, unit, value) of the main parameters
    """

    weight: float
    error: float
    values: tuple[tuple[str, str, float], ...]
    note: str = ""


@dataclass(frozen=True)
class RecordNote:
    """A record as it was read, and what was tolerated in it."""

    record: str
    cylinder: str
    kind: str
    file: str
    samples: int
    duration_s: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Provenance:
    """Enough to make the page again.

    - spec_name, spec_text: the spec, verbatim
    - sha256: (file, hexadecimal digest); versions: (package, version)
    - evaluations_per_s, ess_min, ess_min_per_s: as in result.json
    """

    version: str
    commit: str | None
    command: str
    date: str
    seed: int
    spec_name: str
    spec_text: str
    sha256: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]
    wall_s: float
    compile_s: float | None
    evaluations: int
    failed_solves: int
    evaluations_per_s: float | None = None
    ess_min: float | None = None
    ess_min_per_s: float | None = None
    machine: str = ""


@dataclass(frozen=True, eq=False)
class CalibrationContent:
    """The section on a calibration, complete.

    - title: of the spec; becomes the heading of the page
    - simulated: the page and every figure say so
    - usable: the verdict; false as soon as a check of weight failed
    - summary: a sentence or two below the verdict; may be empty
    - gap: over all records; 1 is the floor
    """

    title: str
    simulated: bool
    usable: bool
    checks: tuple[Check, ...]
    key_numbers: tuple[KeyNumber, ...]
    parameters: tuple[ParameterRow, ...]
    fits: tuple[ChannelFit, ...]
    records: tuple[RecordNote, ...]
    provenance: Provenance
    summary: str = ""
    gap: float | None = None
    products: tuple[ProductRow, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    modes: tuple[ModeRow, ...] = ()
    friction: FrictionCurve | None = None
    draws: Draws | None = None
    traces: tuple[Trace, ...] = ()
    roots: Roots | None = None
