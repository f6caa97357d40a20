"""The section on bands: its content, through the template, into the folder's page."""

import re
from dataclasses import dataclass
from pathlib import Path

from rigid.plots.bands import FieldShown, drops_figure, field_figure
from rigid.plots.illustration import Illustration
from rigid.plots.vector import svg
from rigid.report.content import Check
from rigid.report.page import Section, rebuild, write_section
from rigid.report.templating import environment

NAME, ORDER = "bands", 20


@dataclass(frozen=True)
class BudgetRow:
    """One number of the budget; `parts` are standard uncertainties in the order of the heads."""

    place: str
    name: str
    unit: str
    median: float
    q05: float
    q95: float
    combined: float
    parts: tuple[float | None, ...]


@dataclass(frozen=True, eq=False)
class FieldContent:
    """One field test.

    - record: its name; figures: as drawn; budget: its rows
    - events: sentences on falls of the load and movements of the valve
    - files: (name, what it holds) written for it
    """

    record: str
    figures: tuple[Illustration, ...]
    budget: tuple[BudgetRow, ...]
    events: tuple[str, ...]
    files: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class BandsContent:
    """The section on bands, complete.

    - heads: names of the parts of the budget
    - draws: of all laws together; laws: how many there are; posterior: files the draws come from
    """

    title: str
    simulated: bool
    usable: bool
    checks: tuple[Check, ...]
    heads: tuple[str, ...]
    records: tuple[FieldContent, ...]
    draws: int
    laws: int
    posterior: str
    command: str
    version: str
    seed: int


def illustrations(shown: FieldShown, simulated: bool) -> list[Illustration]:
    """The figures of one record: the whole test, and its drops seen close."""
    name = re.sub(r"[^A-Za-z0-9]+", "-", shown.record)
    whole = Illustration(
        f"fig-bands-{name}",
        svg(field_figure(shown, simulated), f"fig-bands-{name}"),
        f"Record {shown.record}: ice load, displacement of the plate and κ, median with the "
        "bands that hold 50 and 90 %. Dotted: movements of the valve found in the record. Below: "
        "what the uncertainty of the load is made of, as standard deviations.",
        f"Ice load, displacement and kappa over time with bands, record {shown.record}",
    )
    close = drops_figure(shown, simulated)
    if close is None:
        return [whole]
    key = f"fig-bands-drops-{name}"
    caption = (
        "The greatest falls of the load seen close. Dots: what the load cells read. Below: how far "
        "the plate moved since the left edge; the band is that of the displacement itself, so it "
        "has width there, too."
    )
    alt = f"Ice load and displacement about the drops of record {shown.record}"
    return [whole, Illustration(key, svg(close, key), caption, alt)]


def section(content: BandsContent) -> Section:
    """The section as HTML; the same content gives the same bytes."""
    html = environment().get_template("bands.html.j2").render(content=content)
    return Section(NAME, ORDER, "Ice load and displacement", html, content.title, content.simulated)


def write_report(content: BandsContent, folder: Path) -> Path:
    """Writes the section and rebuilds `index.html`; returns the path of the page."""
    write_section(folder, section(content))
    return rebuild(folder)
