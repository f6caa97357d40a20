"""Quantities over the campaigns of a season."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, VERMILION, house_style, new_figure, panel_title
from rigid.report.season.section import QuantityShown, SeasonContent

PLACE = "campaigns"

COLUMNS = 3
MOST_NAMES = 12
"""Campaigns up to which each has its name below the axis."""


def drawn(content: SeasonContent) -> Iterator[Drawn]:
    """The figure, where any campaign gave numbers."""
    if content.shown:
        names = [one.name for one in content.campaigns]
        yield Drawn(
            "season",
            season_figure(content.shown, names, content.simulated),
            "Quantities over the campaigns, in the order of their names: medians with 90 % "
            "intervals. Grey: from a fit that must not be used.",
            "Quantities with uncertainty over campaigns",
            numbers(content.shown, names),
        )


def numbers(shown: Sequence[QuantityShown], names: Sequence[str]) -> Columns:
    """Campaign, 5 % quantile, median and 95 % quantile of every quantity."""
    columns: dict[str, np.ndarray] = {}
    for one in shown:
        columns[f"campaign of {one.label}"] = np.array([names[int(n)] for n in one.when])
        for k, what in enumerate(("5 %", "median", "95 %")):
            columns[f"{one.label}, {what} [{one.unit}]"] = one.interval[:, k]
    return columns


def season_figure(
    shown: Sequence[QuantityShown], campaigns: Sequence[str], simulated: bool
) -> Figure:
    """A panel for each quantity: median and 90 % interval of every campaign."""
    columns = min(COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    with house_style():
        figure = new_figure(0.4 + 2.2 * rows, simulated)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, one in zip(panels, shown, strict=False):
            _panel(axes, one, campaigns)
        for axes in panels[len(shown) :]:
            axes.set_visible(False)
        return figure


def _panel(axes, one: QuantityShown, campaigns: Sequence[str]) -> None:
    for usable, colour in ((True, BLUE if one.verdict == "steady" else VERMILION), (False, GREY)):
        at = one.usable == usable
        low, middle, high = one.interval[at].T
        axes.errorbar(
            one.when[at], middle, yerr=(middle - low, high - middle),
            fmt="o", markersize=3, linewidth=0.8, color=colour,
        )  # fmt: skip
    if len(campaigns) <= MOST_NAMES:
        axes.set_xticks(range(len(campaigns)), campaigns, rotation=40, ha="right")
    axes.set_xlim(-0.5, len(campaigns) - 0.5)
    axes.set_ylabel("" if one.unit in ("", "-", "1") else one.unit)
    panel_title(axes, one.label if one.verdict == "steady" else f"{one.label}: {one.verdict}")
