"""Gap of every record and channel in every run."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import ENSEMBLES, GREY, house_style, new_figure
from rigid.report.compare.content import CompareContent

PLACE = "gaps"
MARKS = "osD^vP*X"


def drawn(content: CompareContent) -> Iterator[Drawn]:
    """The figure, where runs tell their gaps."""
    rows = content.compared.gaps
    if not rows:
        return
    yield Drawn(
        "gaps",
        _figure(content),
        "Residuals of each record and channel over what the sensor's sheet says: 1 is a sensor as "
        "good as its sheet. A channel that lies apart in two runs is fitted differently.",
        f"Gaps of {len(rows)} channels in {len(content.heads)} runs",
        _numbers(content),
    )


def _numbers(content: CompareContent) -> Columns:
    rows = content.compared.gaps
    out: dict[str, np.ndarray] = {
        "record": np.array([row.record for row in rows]),
        "channel": np.array([row.channel for row in rows]),
    }
    for number, name in enumerate(content.heads):
        gaps = [row.gaps[number] for row in rows]
        out[f"gap, {name} [1]"] = np.array([np.nan if gap is None else gap for gap in gaps])
    return out


def _figure(content: CompareContent) -> Figure:
    rows = content.compared.gaps
    with house_style():
        figure = new_figure(1.2 + 0.2 * len(rows), content.simulated)
        axes = figure.add_subplot()
        places = np.arange(len(rows))[::-1]
        for number, name in enumerate(content.heads):
            gaps = np.array([row.gaps[number] for row in rows], float)
            axes.plot(
                gaps, places, MARKS[number % len(MARKS)], markersize=5, markerfacecolor="none",
                color=ENSEMBLES[number % len(ENSEMBLES)], label=name,
            )  # fmt: skip
        axes.axvline(1.0, color=GREY, linewidth=0.8)
        axes.set_yticks(places, [f"{row.record}, {row.channel}" for row in rows])
        axes.set(xlabel="gap [1]", ylim=(-0.7, len(rows) - 0.3))
        figure.legend(loc="outside lower center", ncols=4)
    return figure
