"""Laws of friction side by side: evidence of each, and what each left-out record says."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, VERMILION, house_style, new_figure, panel_title
from rigid.report.laws.section import LawsContent, LawShown

PLACE = "odds"

LINEAR_TO = 4.0
"""Nats up to which the scale is linear; beyond it is logarithmic."""


def drawn(content: LawsContent) -> Iterator[Drawn]:
    """The figure."""
    yield Drawn(
        "evidence",
        laws_figure(content.shown, content.records, content.simulated),
        "Friction models against the first. Above: evidence, with the priors as stated and "
        "otherwise. Below: what each record says when all others predict it, with the error that "
        "simulated campaigns give.",
        "Evidence of every friction model, and differences record by record",
        numbers(content),
    )


def numbers(content: LawsContent) -> Columns:
    """Evidence of every model under every prior, then differences by record."""
    shown = content.shown
    columns = {"model": np.array([one.name for one in shown])}
    for number, prior in enumerate(content.priors):
        columns[f"ln evidence, {prior}"] = np.array([one.evidence[number] for one in shown])
    columns["left-out record"] = np.array(content.records)
    for one in shown[1:]:
        columns[f"ln density, {one.name}"] = one.difference
        columns[f"error, {one.name}"] = one.error
    return columns


def laws_figure(shown: Sequence[LawShown], records: Sequence[str], simulated: bool) -> Figure:
    """Evidence of every law above, differences record by record below."""
    with house_style():
        figure = new_figure(2.6 + 0.22 * len(records) * 1.2 + 0.2 * len(shown), simulated)
        above, below = figure.subplots(
            2, 1, height_ratios=(1.0 + 0.2 * len(shown), 0.2 * len(records) + 0.8)
        )
        rows = np.arange(len(shown))[::-1]
        for row, one in zip(rows, shown, strict=True):
            above.plot(one.evidence[1:], np.full(len(one.evidence) - 1, row), "|", color=GREY)
            above.plot(one.evidence[:1], [row], "o", color=BLUE, markersize=4)
        above.set_yticks(rows, [one.name for one in shown])
        above.set_xscale("symlog", linthresh=LINEAR_TO)
        above.axvline(0.0, color=GREY, linewidth=0.5)
        above.set_xlabel("ln evidence less that of the first law (ticks: other priors)")
        panel_title(above, "evidence")
        _by_record(below, shown[1:], records)
        return figure


def _by_record(axes, shown: Sequence[LawShown], records: Sequence[str]) -> None:
    """Differences of the log predictive density, with their calibrated errors."""
    rows = np.arange(len(records))[::-1].astype(float)
    colours = (VERMILION, BLUE, "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
    for number, one in enumerate(shown):
        offset = 0.6 * (0.5 - (number + 0.5) / max(len(shown), 1))
        axes.errorbar(
            one.difference, rows + offset, xerr=one.error, fmt="o", markersize=2.5, linewidth=0.8,
            color=colours[number % len(colours)], label=one.name,
        )  # fmt: skip
    axes.set_yticks(rows, records)
    axes.set_xscale("symlog", linthresh=LINEAR_TO)
    axes.axvline(0.0, color=GREY, linewidth=0.5)
    axes.set_xlabel("ln predictive density of the left-out record less that by the first law")
    if shown:
        axes.legend(fontsize=6)
    panel_title(axes, "left-out records")
