"""Which story the printed numbers favour."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, ORANGE, house_style, new_figure
from rigid.report.published.section import StoriesContent, StoriesShown

PLACE = "evidence"


def drawn(content: StoriesContent) -> Iterator[Drawn]:
    """The figure, computed from posteriors; nothing on it is a record."""
    caption = (
        "Log Bayes factor of each hypothesis against one constant μ, under the two stated priors."
    )
    yield Drawn(
        "evidence", evidence_figure(content.shown), caption, caption, numbers(content.shown)
    )


def numbers(shown: StoriesShown) -> Columns:
    """What is drawn, in SI."""
    out = {"hypothesis": np.array([story.title for story in shown.stories])}
    for number, (prior, _, _) in enumerate(shown.stories[0].factors):
        told = [story.factors[number] for story in shown.stories]
        out[f"ln B, {prior} prior"] = np.array([value for _, value, _ in told])
        out[f"Monte Carlo error, {prior} prior"] = np.array([error for _, _, error in told])
    return out


def evidence_figure(shown: StoriesShown) -> Figure:
    """ln Bayes factor of each story under both priors."""
    with house_style():
        figure = new_figure(3.6, simulated=False)
        axes = figure.add_subplot()
        rows = np.arange(len(shown.stories))[::-1]
        styles = ((BLUE, "o", 0.12), (ORANGE, "s", -0.12))
        for row, story in zip(rows, shown.stories, strict=True):
            for (_, value, error), (colour, marker, shift) in zip(
                story.factors, styles, strict=True
            ):
                axes.errorbar(
                    value, row + shift, xerr=2 * error, color=colour, marker=marker, markersize=5
                )
        for (name, _, _), (colour, marker, _) in zip(shown.stories[0].factors, styles, strict=True):
            axes.plot([], [], color=colour, marker=marker, linestyle="", label=f"{name} prior")
        axes.axvline(0.0, color=GREY, linewidth=0.6)
        axes.set_yticks(rows, [s.title for s in shown.stories])
        axes.set_xlabel("ln Bayes factor against one constant μ (bars: 2 Monte Carlo errors)")
        axes.legend(loc="lower left")
    return figure
