"""The page of a folder: kept as one section a command, rebuilt from all that are there.

A section lies in DIR/sections/NN-name.html. Its first line is a comment with a JSON head, the
rest is HTML. A command writes its own section and no other.
"""

import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path

from markupsafe import Markup

from rigid.io.files import write_text
from rigid.report.templating import FOLDER, environment

_SCHEMA = 1
_OPENING, _CLOSING = "<!-- rigid-section ", " -->"
_HEADING = re.compile(r'<h3\b[^>]*\bid="([^"]+)"[^>]*>(.*?)</h3>', re.DOTALL)


@dataclass(frozen=True)
class Section:
    """What one command adds to the page.

    - name: of the command; letters, digits, hyphens
    - order: where it stands, 0 to 99 (calibration 10, bands 20, discovery 30, ...)
    - title: its heading
    - html: safe HTML; each `<h3 id="...">` enters the table of contents; ids start with the
      name of the section or of a figure, so that no two sections share one
    - subject: what the page is about; the first section's becomes the heading of the page
    - simulated: whether it rests on simulated data; the page then says so at its top
    """

    name: str
    order: int
    title: str
    html: str
    subject: str = ""
    simulated: bool = False


def write_section(folder: Path, section: Section) -> Path:
    """Puts the section in the place of the one this command wrote before; returns its path."""
    sections = folder / "sections"
    sections.mkdir(parents=True, exist_ok=True)
    path = sections / f"{section.order:02d}-{section.name}.html"
    head = {"schema": _SCHEMA} | asdict(section)
    html = head.pop("html")
    # In JSON only strings hold these; escaped, no title can end the comment.
    text = json.dumps(head).replace("-", "\\u002d").replace(">", "\\u003e")
    write_text(path, f"{_OPENING}{text}{_CLOSING}\n{html}")
    for older in sections.glob(f"[0-9][0-9]-{section.name}.html"):
        if older != path:
            older.unlink()
    return path


def read_section(path: Path) -> Section | None:
    """The section in this file, or None where the file is none."""
    try:
        first, _, html = path.read_text(encoding="utf-8").partition("\n")
        if not (first.startswith(_OPENING) and first.endswith(_CLOSING)):
            return None
        head = json.loads(first.removeprefix(_OPENING).removesuffix(_CLOSING))
        schema = head.pop("schema")
        return Section(html=html, **head) if schema == _SCHEMA else None
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def rebuild(folder: Path) -> Path:
    """Makes DIR/index.html of all sections present; returns its path.

    A file that is no section is named on the page and left out: a stray file must not cost
    anybody the report of a long run.
    """
    read = [(path, read_section(path)) for path in sorted((folder / "sections").glob("*.html"))]
    sections = sorted((s for _, s in read if s), key=lambda section: (section.order, section.name))
    page = (
        environment()
        .get_template("page.html.j2")
        .render(
            subject=next((s.subject for s in sections if s.subject), "Report"),
            simulated=any(section.simulated for section in sections),
            sections=[
                (section, Markup(section.html), _headings(section.html)) for section in sections
            ],
            unreadable=[path.name for path, section in read if section is None],
            style=Markup((FOLDER / "style.css").read_text(encoding="utf-8")),
        )
    )
    write_text(folder / "index.html", page)
    return folder / "index.html"


def _headings(html: str) -> list[tuple[str, str]]:
    """(id, text) of every h3 with an id."""
    return [(anchor, Markup(text).striptags()) for anchor, text in _HEADING.findall(html)]
