"""How often two effects are told apart with each record that could be taken."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import ENSEMBLES, GREY, house_style, new_figure
from rigid.report.content import FoundContent

PLACE = "apart"
MOST = 16
"""Records that are drawn."""


def drawn(content: FoundContent) -> Iterator[Drawn]:
    """The figure."""
    records = [one for one in content.found["records"] if one["beyond"] is None][:MOST]
    if not records:
        return
    pair, now = content.found["between"], content.found["now"]["told"]
    share = f"Share of campaigns in which {pair['first']} and {pair['other']} are told apart"
    yield Drawn(
        "apart",
        _figure(records, now, content.simulated),
        f"{share} with one or several such records; the line is that without any. The best records "
        "stand at the top.",
        f"{share}, by record",
        _numbers(records),
    )


def _numbers(records: Sequence[dict[str, Any]]) -> Columns:
    columns = {"record": np.array([one["record"] for one in records])}
    for place, first in enumerate(records[0]["expected"]):
        told = np.array([one["expected"][place]["told"] for one in records])
        columns[f"told apart with {first['records']} [-]"] = told
    return columns


def _figure(records: Sequence[dict[str, Any]], now: float, simulated: bool) -> Figure:
    rows = np.arange(len(records))[::-1].astype(float)
    with house_style():
        figure = new_figure(1.1 + 0.26 * len(records), simulated)
        axes = figure.subplots()
        for place, first in enumerate(records[0]["expected"]):
            told = [100.0 * one["expected"][place]["told"] for one in records]
            colour = ENSEMBLES[place % len(ENSEMBLES)]
            axes.plot(told, rows, "o", markersize=3, color=colour, label=f"{first['records']}")
        axes.axvline(100.0 * now, color=GREY, linewidth=0.5)
        axes.set_yticks(rows, [one["record"] for one in records])
        axes.set_ylim(-0.7, len(records) - 0.3)
        axes.set_xlabel("told apart with so many such records, % of campaigns")
        axes.legend(title="records", fontsize=7)
        return figure
