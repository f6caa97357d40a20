"""The section on published numbers: its content, through the template, into the folder's page."""

from dataclasses import dataclass
from pathlib import Path

from rigid.plots.illustration import Illustration
from rigid.plots.stories import (
    StoriesShown,
    evidence_figure,
    release_figure,
    roots_figure,
    running_figure,
)
from rigid.plots.vector import svg
from rigid.report.content import Check
from rigid.report.page import Section, rebuild, write_section
from rigid.report.templating import environment

NAME, ORDER = "stories", 12


@dataclass(frozen=True)
class StoryRow:
    """One story or cause in words; `needs`: its own numbers given what is printed."""

    title: str
    assumes: str
    needs: tuple[str, ...]
    decides: str


@dataclass(frozen=True)
class PrintedRow:
    """One printed number: name, as printed, what the printing allows, place and reason."""

    name: str
    value: str
    allows: str
    place: str
    why: str


@dataclass(frozen=True, eq=False)
class StoriesContent:
    """The section, complete.

    `says`: in short. `tables`: (heading, heads, rows) of evidence by prior or reading.
    """

    title: str
    usable: bool
    checks: tuple[Check, ...]
    says: tuple[str, ...]
    printed: tuple[PrintedRow, ...]
    stories: tuple[StoryRow, ...]
    causes: tuple[StoryRow, ...]
    tables: tuple[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]], ...]
    shown: StoriesShown
    command: str
    version: str
    seed: int


def illustrations(shown: StoriesShown) -> list[Illustration]:
    """The figures, each computed from posteriors; nothing on them is a record."""
    bands = "Bands hold 50 and 90 % of the posterior under the catalogue prior."
    made = (
        ("evidence", evidence_figure(shown), "Log Bayes factor of each story against one constant "
         "μ, under the two stated priors."),
        ("roots", roots_figure(shown), "Fig. 4 of the paper with the posterior of each story. "
         "White marks: roots at the published values of μ."),
        ("release", release_figure(shown), "Fig. 8 of the paper as each story predicts it. "
         f"{bands} Dotted: every 10 ms; dashed: 40 ms, both as printed. No record is shown."),
        ("running", running_figure(shown), "Fig. 9 of the paper: strokes at speeds borrowed from "
         "the field test, and the pressure at other speeds under each cause, beside the friction "
         f"of the release. {bands}"),
    )  # fmt: skip
    return [
        Illustration(f"fig-stories-{key}", svg(figure, f"fig-stories-{key}"), caption, caption)
        for key, figure, caption in made
    ]


def section(content: StoriesContent) -> Section:
    """The section as HTML; the same content gives the same bytes."""
    template = environment().get_template("stories.html.j2")
    html = template.render(content=content, figures=illustrations(content.shown))
    return Section(NAME, ORDER, "What the published numbers say", html, content.title, False)


def write_report(content: StoriesContent, folder: Path) -> Path:
    """Writes the section and rebuilds `index.html`; returns the path of the page."""
    write_section(folder, section(content))
    return rebuild(folder)
