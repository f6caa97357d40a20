"""P-values of disagreements between model and records, channel by channel."""

from collections.abc import Iterator

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import house_style, new_figure, panel_title
from rigid.report.discovery.section import ComparedShown, DiscoveryContent

PLACE = "where"


def drawn(content: DiscoveryContent) -> Iterator[Drawn]:
    """The figure."""
    yield Drawn(
        "where",
        compared_figure(content.compared, content.simulated),
        "How often chance alone leaves as large a disagreement somewhere, for every channel and "
        "what its residuals were looked at over: its time, lines of frequency, the lag by which "
        "samples resemble later ones beyond what the noise is taken for, and what its record is "
        "expected to read. P-values count all that was looked at. Grey: not recorded beside it.",
        "P-values of disagreements of all channels",
        numbers(content.compared),
    )


def numbers(shown: ComparedShown) -> Columns:
    """P-values, a row a channel."""
    out = {"channel": np.array(shown.names)}
    for word, table in (("as specified", shown.before), ("with what was added", shown.after)):
        if table is not None:
            out |= {f"{over}, {word}": table[:, i] for i, over in enumerate(shown.over)}
    return out


def compared_figure(shown: ComparedShown, simulated: bool) -> Figure:
    """P-values of all channels, before and after; dark where they disagree beyond chance."""
    tables = [(shown.before, "as specified")]
    if shown.after is not None:
        tables.append((shown.after, "with what was added"))
    with house_style():
        figure = new_figure(max(2.4, 1.4 + 0.17 * len(shown.names)), simulated)
        grid = figure.add_gridspec(1, 2)
        for column, (table, word) in enumerate(tables):
            axes = figure.add_subplot(grid[0, column])
            axes.set_facecolor("0.93")
            image = axes.imshow(table, norm=LogNorm(1e-3, 1.0), cmap="Reds_r", aspect="auto")
            axes.set_xticks(range(len(shown.over)), shown.over, rotation=90)
            axes.set_yticks(range(len(shown.names)), shown.names if column == 0 else ())
            axes.tick_params(length=0)
            panel_title(axes, word)
            if column == len(tables) - 1:
                bar = figure.colorbar(image, ax=axes, shrink=0.7)
                bar.set_label("p-value")
    return figure
