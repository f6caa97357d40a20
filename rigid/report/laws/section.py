"""The section on laws of friction: its content, through the template, into the folder's page."""

from dataclasses import dataclass
from pathlib import Path

from rigid.plots.illustration import Illustration
from rigid.plots.laws import LawShown, laws_figure
from rigid.plots.vector import svg
from rigid.report.page import Section, rebuild, write_section
from rigid.report.templating import environment

NAME, ORDER = "laws", 40


@dataclass(frozen=True, eq=False)
class LawsContent:
    """The section, complete; every difference is to the first law.

    - `settled`: whether there is a law to go on with. - `ruling`: the verdict in a sentence.
    - `notes`: sentences. - `laws`: (name, log evidence, its error, probability, log predictive
      density, its error, tied). - `priors`: what is done to the amplitudes' priors.
    - `chances`: (name, probability under each). - `parameters`: (law, name, unit, q05, median,
      q95). - `shown`, `records`: for the figure.
    """

    title: str
    simulated: bool
    settled: bool
    ruling: str
    notes: tuple[str, ...]
    laws: tuple[tuple[str, float, float, float, float, float, bool], ...]
    priors: tuple[str, ...]
    chances: tuple[tuple[str, tuple[float, ...]], ...]
    parameters: tuple[tuple[str, str, str, float, float, float], ...]
    shown: tuple[LawShown, ...]
    records: tuple[str, ...]
    command: str
    version: str
    seed: int


def section(content: LawsContent) -> Section:
    """The section as HTML; the same content gives the same bytes."""
    key = "fig-laws"
    figure = Illustration(
        key,
        svg(laws_figure(content.shown, content.records, content.simulated), key),
        "Laws of friction against the first. Above: evidence, with the priors as stated and "
        "otherwise. Below: what each record says when all others predict it, with the error that "
        "simulated campaigns give.",
        "Evidence of every law, and differences record by record",
    )
    html = environment().get_template("laws.html.j2").render(content=content, figure_of_laws=figure)
    return Section(NAME, ORDER, "Laws of friction", html, content.title, content.simulated)


def write_report(content: LawsContent, folder: Path) -> Path:
    """Writes the section and rebuilds `index.html`; returns the path of the page."""
    write_section(folder, section(content))
    return rebuild(folder)
