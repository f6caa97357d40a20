"""Have the ensembles found the same place: their means over the steps, and their ranks."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid.plots import metrology
from rigid.plots.decimate import line_points
from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import Trace
from rigid.plots.style import ENSEMBLES, GREY, PALE, house_style, new_figure, tex
from rigid.report.content import CalibrationContent

PLACE = "convergence"

WALKED = (
    "One colour an ensemble. Left of each pair: mean over the walkers at each step; grey: "
    "discarded, and cut off where far away. Right: where the draws of each ensemble rank among "
    "all draws; ensembles that sample the same posterior lie around the dashed line."
)
WEIGHTED = (
    "One colour a lot of weighted draws. Left of each pair: mean over the parts of a lot, draw by "
    "draw. Right: where the draws of each lot rank among all draws; lots of the same posterior lie "
    "around the dashed line."
)
_COLUMNS = 2
_ROW_HEIGHT = 1.55


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """The figure, where there are traces."""
    if not content.traces:
        return
    yield Drawn(
        "traces",
        trace_figure(content.traces, content.simulated),
        WEIGHTED if content.weighed else WALKED,
        "Means over steps, and rank histograms, of each ensemble or lot",
        numbers(content.traces),
    )


def numbers(traces: Sequence[Trace]) -> Columns:
    """Means by step and counts by rank, of every ensemble."""
    columns: dict[str, np.ndarray] = {"step": traces[0].step}
    for trace in traces:
        for number, (means, ranks) in enumerate(zip(trace.means, trace.ranks, strict=True), 1):
            columns[f"{trace.symbol} mean of ensemble {number} [{trace.unit}]"] = means
            columns[f"{trace.symbol} draws by rank of ensemble {number}"] = ranks
    return columns


def trace_figure(traces: Sequence[Trace], simulated: bool) -> Figure:
    """Two panels a parameter: ensemble means over steps, and rank histograms by ensemble."""
    rows = -(-len(traces) // _COLUMNS)
    with house_style():
        figure = new_figure(_ROW_HEIGHT * rows + 0.6, simulated)
        grid = figure.add_gridspec(rows, 2 * _COLUMNS, width_ratios=(1.7, 1) * _COLUMNS)
        for index, trace in enumerate(traces):
            row, column = divmod(index, _COLUMNS)
            last = index + _COLUMNS >= len(traces)
            _means(figure.add_subplot(grid[row, 2 * column]), trace, last)
            _ranks(figure.add_subplot(grid[row, 2 * column + 1]), trace, last)
    return figure


def _means(axes: Axes, trace: Trace, last: bool) -> None:
    kept = trace.means[:, trace.step >= trace.kept_from]
    factor, unit = metrology.axis(kept if kept.size else trace.means, trace.unit)
    first, end = int(trace.step[0]), int(trace.step[-1])
    if trace.kept_from > first:
        axes.axvspan(first, trace.kept_from, color=PALE, alpha=0.5, linewidth=0)
    for ensemble, means in enumerate(trace.means * factor):
        points = line_points(means)
        color = ENSEMBLES[ensemble % len(ENSEMBLES)]
        axes.plot(trace.step[points], means[points], color=color, linewidth=0.7)
    axes.set_xlim(first, end)
    axes.set_ylim(*_reach(kept * factor if kept.size else trace.means * factor))
    axes.set_ylabel(f"{tex(trace.symbol)} [{unit}]")
    if last:
        axes.set_xlabel("step [1]")


def _reach(kept: np.ndarray) -> tuple[float, float]:
    """Limits that show the kept part with room around it; what was discarded may leave them."""
    low, high = float(np.nanmin(kept)), float(np.nanmax(kept))
    margin = 0.75 * (high - low) or 0.5 * abs(high) or 1.0
    return low - margin, high + margin


def _ranks(axes: Axes, trace: Trace, last: bool) -> None:
    bins = trace.ranks.shape[1]
    share = trace.ranks / np.maximum(trace.ranks.mean(axis=1, keepdims=True), 1e-300)
    axes.axhline(1.0, color=GREY, linewidth=0.7, linestyle=(0, (4, 2)))
    edges = np.linspace(0.0, 1.0, bins + 1)
    for ensemble, heights in enumerate(share):
        color = ENSEMBLES[ensemble % len(ENSEMBLES)]
        axes.stairs(heights, edges, color=color, linewidth=0.8)
    axes.set_xlim(0, 1)
    axes.set_ylim(0, max(2.0, 1.05 * float(share.max())))
    axes.set_ylabel("density [1]")
    if last:
        axes.set_xlabel("rank / draws [1]")
