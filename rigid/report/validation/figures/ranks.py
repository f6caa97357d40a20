"""Ranks of the truths: difference of their distribution to the uniform one."""

from collections.abc import Iterator

from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, PALE, VERMILION, house_style, new_figure, panel_title
from rigid.report.validation.section import RankShown, ValidationContent

PLACE = "ranks"


def drawn(content: ValidationContent) -> Iterator[Drawn]:
    """The figure."""
    if content.shown:
        yield Drawn(
            "ranks",
            ranks_figure(content),
            "Where the truths lie in their posteriors: share of truths below each posterior "
            "probability, less that probability. Shaded: where a curve of a sound posterior stays "
            "whole in 95 of 100 studies. Red: quantities that fail, corrected for the number of "
            "tests. Above the band on the left and below it on the right: intervals too narrow.",
            "Difference of rank distributions to the uniform one, with the band",
            numbers(content),
        )


def numbers(content: ValidationContent) -> Columns:
    """The band, then every curve."""
    at = content.shown[0].at
    columns = {"posterior probability": at, "least": content.least, "greatest": content.greatest}
    return columns | {one.name: one.difference for one in content.shown}


def ranks_figure(content: ValidationContent) -> Figure:
    """Single quantities to the left, the posterior as a whole to the right."""
    with house_style():
        figure = new_figure(3.4, content.simulated)
        left, right = figure.subplots(1, 2, sharey=True)
        for axes, joint, title in ((left, False, "quantities"), (right, True, "as a whole")):
            panel_title(axes, title)
            shown = [one for one in content.shown if one.joint == joint]
            axes.fill_between(
                content.shown[0].at, content.least, content.greatest, color=PALE, linewidth=0
            )
            for number, one in enumerate(shown):
                axes.plot(one.at, one.difference, **_look(one, number))
            axes.axhline(0.0, color=GREY, linewidth=0.5)
            axes.set_xlabel("posterior probability below the truth")
            if any(not one.ok or joint for one in shown):
                axes.legend(fontsize=6)
        left.set_ylabel("share of truths, less expected")
        return figure


def _look(one: RankShown, number: int) -> dict:
    """Failing curves and joint ones have a name, the others are many."""
    label = one.name if one.joint or not one.ok else None
    colour = VERMILION if not one.ok else BLUE
    style = "--" if one.joint and number else "-"
    return {"color": colour, "linewidth": 1.1 if label else 0.4, "label": label, "linestyle": style}
