"""Quantities over the campaigns of a season."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, VERMILION, house_style, new_figure, panel_title
from rigid.report.season.output import USABLE
from rigid.report.season.section import SeasonContent

PLACE = "campaigns"

COLUMNS = 3
MOST_SHOWN = 9
"""Panels."""
MOST_NAMES = 12
"""Campaigns up to which each has its name below the axis."""


@dataclass(frozen=True, eq=False)
class QuantityShown:
    """One quantity of the figure.

    - `label`; `unit`. - `when` (campaigns,): number of the campaign. - `interval` (campaigns, 3):
      q05, median, q95. - `usable` (campaigns,). - `verdict`: steady, or how it changes.
    """

    label: str
    unit: str
    when: Float[np.ndarray, " campaigns"]
    interval: Float[np.ndarray, "campaigns 3"]
    usable: Bool[np.ndarray, " campaigns"]
    verdict: str


def drawn(content: SeasonContent) -> Iterator[Drawn]:
    """The figure, where any campaign gave numbers."""
    if content.ranked:
        shown = [_shown(content.found, label) for label in content.ranked[:MOST_SHOWN]]
        names = [one["name"] for one in content.found["campaigns"]]
        yield Drawn(
            "season",
            season_figure(shown, names, content.simulated),
            "Quantities over the campaigns, in the order of their names: medians with 90 % "
            "intervals. Grey: from a fit that must not be used.",
            "Quantities with uncertainty over campaigns",
            numbers(shown, names),
        )


def _shown(found: Mapping[str, Any], label: str) -> QuantityShown:
    there = [
        (number, one["parameters"][label], one["status"] == USABLE)
        for number, one in enumerate(found["campaigns"])
        if label in one.get("parameters", {})
    ]
    return QuantityShown(
        label,
        found["quantities"][label]["unit"],
        np.array([n for n, _, _ in there], dtype=float),
        np.array([[p["q05"], p["median"], p["q95"]] for _, p, _ in there], dtype=float),
        np.array([usable for _, _, usable in there]),
        found["quantities"][label]["verdict"],
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


def _panel(axes: Axes, one: QuantityShown, campaigns: Sequence[str]) -> None:
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
