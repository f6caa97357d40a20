"""Fig. 9 of the paper: free running under each cause of its pressure."""

from collections.abc import Iterator
from textwrap import fill

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigid.plots.banded import banded, quantile_columns
from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, VERMILION, house_style, new_figure, panel_title
from rigid.report.published.section import BANDS, COMPUTED, StoriesContent, StoriesShown

PLACE = "figures"


def drawn(content: StoriesContent) -> Iterator[Drawn]:
    """The figure, computed from posteriors; nothing on it is a record."""
    caption = (
        "Fig. 9 of the paper: strokes at speeds borrowed from the field test, and the pressure at "
        f"other speeds under each cause, beside the friction of the release. {BANDS}"
    )
    yield Drawn("running", running_figure(content.shown), caption, caption, numbers(content.shown))


def numbers(shown: StoriesShown) -> Columns:
    """What is drawn, in SI."""
    out = {"time [s]": shown.run_time, "speed [m/s]": shown.speeds}
    for name, band in shown.stroke:
        out |= quantile_columns(f"stroke of {name}", "m", band)
    for cause in shown.causes:
        for name, band in cause.pressure:
            out |= quantile_columns(f"pressure of {name} under {cause.title}", "Pa", band)
    return out


def running_figure(shown: StoriesShown) -> Figure:
    """Fig. 9: strokes at borrowed speeds, and the pressure at other speeds under each cause."""
    count = len(shown.causes)
    with house_style():
        figure = new_figure(5.2, simulated=False)
        grid = figure.add_gridspec(2, count)
        top = figure.add_subplot(grid[0, :])
        for colour, (name, band) in zip((BLUE, VERMILION), shown.stroke, strict=True):
            banded(top, shown.run_time, band * 1e3, colour)
            top.plot([], [], color=colour, label=f"cylinder {name}")
        top.set(xlabel="time [s]", ylabel="stroke [mm]", xlim=(0, shown.run_time[-1]))
        top.legend(loc="upper left")
        panel_title(top, f"Stroke if κ is about that of the field test ({COMPUTED})")
        first = None
        for column, cause in enumerate(shown.causes):
            axes = figure.add_subplot(grid[1, column], sharey=first)
            first = first or axes
            for colour, (_, band) in zip((BLUE, VERMILION), cause.pressure, strict=True):
                banded(axes, shown.speeds * 1e3, band * 1e-5, colour)
            for colour, (_, speed, pressure) in zip((BLUE, VERMILION), shown.borrowed, strict=True):
                axes.plot(speed * 1e3, pressure * 1e-5, "o", color=colour, markeredgecolor="white")
            axes.set_title(fill(cause.title, 26), loc="left", fontsize=7.5)
            axes.set(xlim=(0, shown.speeds[-1] * 1e3), xlabel="speed [mm/s]")
            if column:
                axes.tick_params(labelleft=False)
            else:
                axes.set(ylabel="pressure [bar]", ylim=(0, 150))
        handle = Line2D([], [], marker="o", color=GREY, linestyle="", label="printed μ, borrowed κ")
        figure.legend(handles=[handle], loc="outside lower right")
    return figure
