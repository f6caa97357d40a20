"""Fig. 8 of the paper as each story predicts it."""

from collections.abc import Iterator

from matplotlib.figure import Figure

from rigid.plots.banded import banded, quantile_columns
from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import GREY, VERMILION, house_style, new_figure, panel_title
from rigid.report.published.section import BANDS, COLOURS, COMPUTED, StoriesContent, StoriesShown

PLACE = "figures"


def drawn(content: StoriesContent) -> Iterator[Drawn]:
    """The figure, computed from posteriors; nothing on it is a record."""
    caption = (
        f"Fig. 8 of the paper as each hypothesis predicts it. {BANDS} Dotted: every 10 ms; dashed: "
        "40 ms, both as printed. No record is shown."
    )
    yield Drawn("release", release_figure(content.shown), caption, caption, numbers(content.shown))


def numbers(shown: StoriesShown) -> Columns:
    """What is drawn, in SI."""
    out = {"time [s]": shown.time}
    for story in shown.stories:
        out |= quantile_columns(story.title, "m/s^2", story.acceleration)
    return out


def release_figure(shown: StoriesShown) -> Figure:
    """Fig. 8: what the accelerometer would record under each story."""
    columns = 3
    rows = -(-len(shown.stories) // columns)
    with house_style():
        figure = new_figure(1.9 * rows + 0.4, simulated=False)
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for colour, axes, story in zip(COLOURS, panels, shown.stories, strict=False):
            banded(axes, shown.time * 1e3, story.acceleration, colour)
            for k in range(4):
                axes.axvline(k * shown.period * 1e3, color=GREY, linewidth=0.7, linestyle=":")
            axes.axvline(shown.duration * 1e3, color=VERMILION, linewidth=0.8, linestyle="--")
            panel_title(axes, story.title)
        for axes in panels[len(shown.stories) :]:
            axes.set_axis_off()
        panels[0].set_xlim(0.0, shown.time[-1] * 1e3)
        figure.supxlabel("time since the release [ms]", fontsize=9)
        figure.supylabel(f"acceleration [m/s²], {COMPUTED}", fontsize=9)
    return figure
