"""What every section has, and all that the one on a calibration shows: values to print and save.

SI units throughout, unless a field names a unit. None stands for "not available".
What the figures show is defined beside the plots, in `rigid.plots.shown`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rigid.inference.alternatives import Alternative
from rigid.inference.summary import Check, Summary
from rigid.plots.figure import Illustration
from rigid.plots.shown import ChannelFit, FrictionCurve, ParameterDraws, Roots, Trace
from rigid.report.paper_values import Published
from rigid.report.taken import sentences
from rigid.spec import Spec


@dataclass(frozen=True)
class KeyNumber:
    """One of the few numbers people come for.

    - label: in words ("stiffness of the load-cell end"); symbol: TeX without dollar signs
    - reading: one sentence on what it means; left empty, the page compares with `published`
    - range: of a row that stands for several numbers, "0.12 to 0.25", in place of one
    - name: of the parameter, as in summary.csv; empty where it is none
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
    range: str = ""
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class ParameterShown(Summary):
    """Figures of a parameter, prior beside posterior.

    - name: as in summary.csv, e.g. kappa[free-run-2,A]
    - informed: 1 - posterior sd / prior sd on the standard scale; 0 if only the prior speaks
    """

    name: str
    symbol: str
    unit: str
    prior_median: float
    prior_q05: float
    prior_q95: float
    informed: float | None
    published: tuple[Published, ...] = ()
    note: str = ""


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
    """Enough to make the section again.

    - `command`: as it was run. - `commit`: None where the package is not run from a checkout.
    - `spec_name`, `spec_text`: the spec, verbatim.
    - `sha256`: (file or record, hexadecimal digest); `versions`: (package, version).
    - `wall_s`, `cpu_s`: what the command took. - `compile_s`, `evaluations`, `failed_solves`,
      `evaluations_per_s`, `ess_min`, `ess_min_per_s`: as in result.json.
    """

    version: str
    commit: str | None
    command: str
    date: str
    seed: int | None
    spec_name: str
    spec_text: str
    sha256: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]
    wall_s: float | None = None
    cpu_s: float | None = None
    compile_s: float | None = None
    evaluations: int | None = None
    failed_solves: int | None = None
    evaluations_per_s: float | None = None
    ess_min: float | None = None
    ess_min_per_s: float | None = None
    machine: str = ""


@dataclass(frozen=True)
class Answer:
    """One of the few answers that a reader comes for.

    - `question`: what it answers, in words ("stiffness of the load-cell end").
    - `symbol`: TeX without dollar signs; may be empty. - `value`: with its uncertainty, as printed.
    - `says`: what it changes against what was known, in a sentence; may be empty.
    """

    question: str
    value: str
    says: str = ""
    symbol: str = ""


GOOD, RESERVE, BAD = "good", "reserve", "bad"


@dataclass(frozen=True)
class Front:
    """The first screen of a section.

    - `asked`: the question in a sentence.
    - `state`: GOOD, RESERVE or BAD. - `ruling`: may it be used, or the verdict, in a sentence.
    - `why`: the reasons, a sentence each. - `answers`.
    - `cannot`: what these records cannot say. - `next`: what to do now, a sentence each.
    - `figure`: name of the one figure, as `Drawn.name`; empty: none.
    """

    asked: str
    state: str
    ruling: str
    why: tuple[str, ...] = ()
    answers: tuple[Answer, ...] = ()
    cannot: tuple[str, ...] = ()
    next: tuple[str, ...] = ()
    figure: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class Content:
    """What every section has.

    - `title`: of the spec; becomes the heading of the page.
    - `simulated`: the page and every figure say so.
    - `checks`: what must hold for the result to be used.
    - `drawn`: figures that come with the content, with the place of each.
    - `taken`: what was held exact and what was set aside, a sentence each.
    """

    title: str
    simulated: bool
    front: Front
    provenance: Provenance
    checks: tuple[Check, ...] = ()
    drawn: tuple[tuple[str, Illustration], ...] = ()
    taken: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundContent(Content):
    """A section that shows what a command writes to its JSON file.

    - `found`: what stands in the file. - `notes`: sentences on how to read it.
    """

    found: Mapping[str, Any]
    notes: tuple[str, ...] = ()


def found_content(
    spec: Spec, made: dict[str, Any], provenance: Provenance, front: Front, notes: tuple[str, ...]
) -> FoundContent:
    """Gather the section of a command; `made` is what goes to its JSON file."""
    return FoundContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        front=front,
        provenance=provenance,
        checks=tuple(Check(**one) for one in made["checks"]),
        taken=sentences(made),
        found=made,
        notes=notes,
    )


@dataclass(frozen=True)
class BudgetLine:
    """A line of an uncertainty budget.

    - `source`; `kind`: "A", by statistics of the records, or "B", known before.
    - `estimate`, `uncertainty` [unit]: of the input quantity, its standard uncertainty.
    - `sensitivity`: of the result to it; `contribution`: to the result's standard uncertainty, in
      the result's unit.
    """

    source: str
    kind: str
    estimate: float | None
    uncertainty: float | None
    unit: str
    sensitivity: float | None
    contribution: float


@dataclass(frozen=True)
class GumBudget:
    """The budget of one number: `combined` is its standard uncertainty, all varied together."""

    name: str
    unit: str
    estimate: float
    combined: float
    lines: tuple[BudgetLine, ...]


@dataclass(frozen=True)
class ForPaper:
    """What goes into a paper as it stands: two paragraphs, a table, references."""

    methods: str
    results: str
    latex: str
    bibtex: str


@dataclass(frozen=True, eq=False, kw_only=True)
class CalibrationContent(Content):
    """The section on a calibration, complete.

    - `usable`: false as soon as a check of weight failed.
    - `products`: combinations of parameters that the records identify better than their parts.
    - `gap`: over all records; 1 is the floor.
    """

    usable: bool
    key_numbers: tuple[KeyNumber, ...]
    parameters: tuple[ParameterShown, ...]
    fits: tuple[ChannelFit, ...]
    records: tuple[RecordNote, ...]
    gap: float | None = None
    products: tuple[KeyNumber, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    modes: tuple[ModeRow, ...] = ()
    friction: FrictionCurve | None = None
    draws: ParameterDraws | None = None
    traces: tuple[Trace, ...] = ()
    weighed: bool = False
    roots: Roots | None = None
    budgets: tuple[GumBudget, ...] = ()
    paper: ForPaper | None = None
