"""One way to make a section of the page: a kind, a content, the figures of its folder.

A command says what its section is (`Kind`), gathers a content (a subclass of
`rigid.report.content.Content`), and calls `write_report`. The template extends
`section.html.j2`, which puts the front, the checks and the provenance into every section.
"""

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from rigid.report.content import Content
from rigid.report.gallery import Gallery, hang, take_down
from rigid.report.page import Section, rebuild, write_section
from rigid.report.templating import environment


@dataclass(frozen=True)
class Kind:
    """What a command adds to the page.

    - `name`: of the command; `order`: where it stands on the page, 0 to 99; `title`: its heading.
    - `template`: a file of `rigid/report/templates/`.
    - `figures`: the package that holds a file for each figure; None: they come with the content.
    """

    name: str
    order: int
    title: str
    template: str
    figures: ModuleType | None = None


def section(kind: Kind, content: Content, folder: Path | None = None) -> Section:
    """The section as HTML; the same content gives the same bytes.

    - `folder`: of the page; the figures are written to `figures/` in it. None: no file is written.
    """
    placed = list(content.drawn)
    if kind.figures is not None:
        placed += hang(kind.figures, content, kind.name, folder)
    template = environment().get_template(kind.template)
    html = template.render(kind=kind, content=content, figures=Gallery(placed))
    return Section(kind.name, kind.order, kind.title, html, content.title, content.simulated)


def write_report(kind: Kind, content: Content, folder: Path) -> Path:
    """Write the section with its figures, and rebuild `index.html`; returns the page's path."""
    if kind.figures is not None:
        take_down(folder, kind.name)
    write_section(folder, section(kind, content, folder))
    return rebuild(folder)
