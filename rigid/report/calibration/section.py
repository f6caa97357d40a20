"""The section on a calibration: its content, through the template, into the folder's page."""

from pathlib import Path

from rigid.report import wording
from rigid.report.calibration import illustrations as figures
from rigid.report.content import CalibrationContent
from rigid.report.page import Section, rebuild, write_section
from rigid.report.templating import environment

NAME, ORDER = "calibration", 10


def section(content: CalibrationContent) -> Section:
    """The section as HTML; the same content gives the same bytes."""
    html = (
        environment()
        .get_template("calibration.html.j2")
        .render(
            content=content,
            verdict=wording.verdict(content),
            friction=figures.friction(content),
            roots=figures.roots(content),
            records=list(figures.records(content)),
            pairs=figures.pairs(content),
            traces=figures.traces(content),
        )
    )
    return Section(NAME, ORDER, "Calibration", html, content.title, content.simulated)


def write_report(content: CalibrationContent, folder: Path) -> Path:
    """Writes the section and rebuilds `index.html`; returns the path of the page."""
    write_section(folder, section(content))
    return rebuild(folder)
