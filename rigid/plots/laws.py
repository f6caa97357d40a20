"""Laws of friction side by side: evidence of each, and what each left-out record says."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from rigid.plots.style import BLUE, GREY, VERMILION, house_style, new_figure, panel_title

LINEAR_TO = 4.0
"""Nats up to which the scale is linear; beyond it is logarithmic."""


@dataclass(frozen=True, eq=False)
class LawShown:
    """One law against the first.

    - `name`. - `evidence` (variants,): difference of log evidence, priors as stated first.
    - `difference`, `error` (records,): of the log predictive density of each left-out record.
    """

    name: str
    evidence: Float[np.ndarray, " variants"]
    difference: Float[np.ndarray, " records"]
    error: Float[np.ndarray, " records"]


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
