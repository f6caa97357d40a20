"""What each record that could be taken is expected to leave of a standard deviation."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import ENSEMBLES, GREY, house_style, new_figure
from rigid.report.content import FoundContent

PLACE = "expected"
MOST = 16
"""Records that are drawn."""


def drawn(content: FoundContent) -> Iterator[Drawn]:
    """The figure."""
    records = [one for one in content.found["records"] if one["beyond"] is None][:MOST]
    if not records:
        return
    names = [one["name"] for one in content.found["quantities"]]
    yield Drawn(
        "expected",
        _figure(records, names, content.simulated),
        "Standard deviation with one such record over that without, by quantity; bars go from "
        "5 to 95 %. The best records stand at the top.",
        f"Expected factor of the standard deviation by record, for {', '.join(names)}",
        _numbers(records, names),
    )


def _told(record: dict[str, Any], name: str) -> dict[str, Any]:
    return next(e for e in record["expected"] if e["quantity"] == name and e["records"] == 1)


def _numbers(records: Sequence[dict[str, Any]], names: Sequence[str]) -> Columns:
    columns = {"record": np.array([one["record"] for one in records])}
    for name in names:
        for key, head in (("factor", ""), ("factor_q05", ", 5 %"), ("factor_q95", ", 95 %")):
            columns[f"{name}{head}"] = np.array([_told(one, name)[key] for one in records])
    return columns


def _figure(records: Sequence[dict[str, Any]], names: Sequence[str], simulated: bool) -> Figure:
    rows = np.arange(len(records))[::-1].astype(float)
    with house_style():
        figure = new_figure(1.1 + 0.26 * len(records), simulated)
        axes = figure.subplots()
        for number, name in enumerate(names):
            listed = [_told(one, name) for one in records]
            middle = np.array([e["factor"] for e in listed])
            ends = np.array([[e["factor_q05"] for e in listed], [e["factor_q95"] for e in listed]])
            offset = 0.5 * (0.5 - (number + 0.5) / len(names))
            axes.errorbar(
                middle, rows + offset, xerr=np.abs(ends - middle), fmt="o", markersize=3,
                linewidth=1.0, color=ENSEMBLES[number % len(ENSEMBLES)], label=name,
            )  # fmt: skip
        axes.axvline(1.0, color=GREY, linewidth=0.5)
        axes.set_yticks(rows, [one["record"] for one in records])
        axes.set_ylim(-0.7, len(records) - 0.3)
        what = f"of {names[0]} " if len(names) == 1 else ""
        axes.set_xlabel(f"standard deviation {what}with one such record, over that without")
        if len(names) > 1:
            axes.legend(fontsize=7, loc="lower left")  # the best, far on the left, stand at the top
        return figure
