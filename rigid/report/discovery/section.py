"""The section on discovery: its content, through the template, into the folder's page."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.plots.discovery import (
    AgainstShown,
    ComparedShown,
    HiddenShown,
    ResidualShown,
    against_figure,
    compared_figure,
    hidden_figure,
    matrix_figure,
    residuals_figure,
)
from rigid.plots.illustration import Illustration
from rigid.plots.vector import svg
from rigid.report.content import Check
from rigid.report.page import Section, rebuild, write_section
from rigid.report.templating import environment

NAME, ORDER = "discovery", 30


class Moved(NamedTuple):
    """A quoted number without and with an effect: medians, and by how many sds of the later fit."""

    label: str
    means: str
    unit: str
    before: float
    after: float
    sds: float


@dataclass(frozen=True, eq=False)
class StepContent:
    """One turn: sentences and tables of what was found, added and moved.

    - `sentences`. - `odds`: (name, probability, log Bayes factor, how it was found).
    - `parameters`: (name, meaning, unit, q05, median, q95). - `moved`: quoted numbers.
    - `gaps`: (what, before, after). - `against`, `residuals`, `hidden`: for the figures.
    """

    heading: str
    sentences: tuple[str, ...]
    odds: tuple[tuple[str, float, float, str], ...]
    parameters: tuple[tuple[str, str, str, float, float, float], ...]
    moved: tuple[Moved, ...]
    gaps: tuple[tuple[str, str, str], ...]
    against: AgainstShown | None
    residuals: tuple[ResidualShown, ...]
    hidden: HiddenShown | None


@dataclass(frozen=True, eq=False)
class DiscoveryContent:
    """The section, complete.

    - `ruling`: the verdict in a sentence. - `lead`: what a reader asks first, and the answers, a
      paragraph for each step.
    - `steps`. - `ending`: what is left at the end.
    - `where`: a sentence on where model and records disagree, and a row for each disagreement:
      (channel, over what, from where to where, p-value, p-value with what was added).
    - `compared`: for the figure. - `bets`: what one would bet before any record, in a sentence.
    - `notes`: on the records as they were read. - `solver`: the check of the solver.
    - `names`, `cosines` (n, n): what the records can tell apart. - `pairs`: sentences on it.
    - `rejected`: (effect, why, from what size on it would have shown); `shown`: at what strength.
    """

    title: str
    simulated: bool
    verdict: str
    ruling: str
    lead: tuple[tuple[str, tuple[str, ...]], ...]
    steps: tuple[StepContent, ...]
    where: tuple[str, tuple[tuple[str, str, str, str, str], ...]]
    compared: ComparedShown
    bets: str
    ending: tuple[str, ...]
    notes: tuple[str, ...]
    solver: Check | None
    names: tuple[str, ...]
    cosines: Float[np.ndarray, "n n"]
    pairs: tuple[str, ...]
    rejected: tuple[tuple[str, str, str], ...]
    shown: float
    command: str
    version: str
    seed: int


def illustrations(number: int, step: StepContent, simulated: bool) -> list[Illustration]:
    """Figures of one step."""
    out = []
    if step.against is not None:
        key = f"fig-discovery-against-{number}"
        caption = (
            "What the records leave over, against what the effect explains of it, in classes of "
            "samples that tell about as much each; bars: one standard deviation. Were the effect "
            "not there, the points on the left would lie on the level line; as it is, along the "
            "dashed one. With the effect in the model nothing should be left, on the right."
        )
        drawing = svg(against_figure(step.against, simulated), key)
        out.append(Illustration(key, drawing, caption, "Left over against explained"))
    if step.residuals:
        key = f"fig-discovery-residuals-{number}"
        first = step.residuals[0]
        kind = (
            "Size of each line of frequency in residuals over what the sensors' sheets allow"
            if first.frequencies
            else "Residuals over what the sensors' sheets allow, averaged over "
            f"{first.smoothed} samples"
        )
        drawn = "" if first.explained is None else " Black: what the effect takes away."
        caption = f"{kind}, without and with the effect, in one scale. Grey: where it shows.{drawn}"
        drawing = svg(residuals_figure(step.residuals, simulated), key)
        out.append(Illustration(key, drawing, caption, "Residuals before and after the addition"))
    if step.hidden is not None:
        key = f"fig-discovery-hidden-{number}"
        caption = "What would have to be added to the model for it to explain the records."
        drawing = svg(hidden_figure(step.hidden, simulated), key)
        out.append(Illustration(key, drawing, caption, "Inferred hidden quantity"))
    return out


def section(content: DiscoveryContent) -> Section:
    """The section as HTML; the same content gives the same bytes."""
    key = "fig-discovery-matrix"
    matrix = Illustration(
        key,
        svg(matrix_figure(content.names, content.cosines, content.simulated), key),
        "What these records can tell apart, before any of them is looked at: the cosine of the "
        "traces that two effects leave once everything uncertain has absorbed what its prior lets "
        "it. Near 1 or -1, one can pass for the other, unless physics forbids the sign. The "
        "strength of an effect is how many standard deviations of the noise it shows by, in all "
        "records together.",
        "Matrix of cosines between the traces of all effects",
    )
    key = "fig-discovery-where"
    where = Illustration(
        key,
        svg(compared_figure(content.compared, content.simulated), key),
        "How often chance alone leaves as large a disagreement somewhere, for every channel and "
        "what its residuals were looked at over: its time, lines of frequency, the lag by which "
        "samples resemble later ones beyond what the noise is taken for, and what its record is "
        "expected to read. P-values count all that was looked at. Grey: not recorded beside it.",
        "P-values of disagreements of all channels",
    )
    figures = [
        illustrations(i, step, content.simulated) for i, step in enumerate(content.steps, start=1)
    ]
    html = (
        environment()
        .get_template("discovery.html.j2")
        .render(
            content=content,
            steps=list(zip(content.steps, figures, strict=True)),
            matrix=matrix,
            where=where,
        )
    )
    return Section(NAME, ORDER, "What is missing", html, content.title, content.simulated)


def write_report(content: DiscoveryContent, folder: Path) -> Path:
    """Writes the section and rebuilds `index.html`; returns the path of the page."""
    write_section(folder, section(content))
    return rebuild(folder)
