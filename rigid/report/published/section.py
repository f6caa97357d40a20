"""The section on published numbers: what it is on the page, and its content."""

from dataclasses import dataclass

from rigid.report.content import Content
from rigid.report.published import figures
from rigid.report.published.shown import StoriesShown
from rigid.report.section import Kind

KIND = Kind("stories", 12, "What the published numbers say", "stories.html.j2", figures)


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


@dataclass(frozen=True, eq=False, kw_only=True)
class StoriesContent(Content):
    """The section, complete.

    `says`: in short. `tables`: (heading, heads, rows) of evidence by prior or reading.
    """

    says: tuple[str, ...]
    printed: tuple[PrintedRow, ...]
    stories: tuple[StoryRow, ...]
    causes: tuple[StoryRow, ...]
    tables: tuple[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]], ...]
    shown: StoriesShown
