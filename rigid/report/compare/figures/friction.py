"""Friction over frequency of all runs in one panel."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import QUANTILES
from rigid.plots.style import ENSEMBLES, house_style, new_figure
from rigid.report.compare.content import CompareContent
from rigid.report.compare.runs import Run

PLACE = "friction"


def drawn(content: CompareContent) -> Iterator[Drawn]:
    """The figure, where some run has friction over frequency."""
    runs = [run for run in content.compared.runs if run.friction is not None]
    if not runs:
        return
    yield Drawn(
        "friction",
        _figure(runs, content.simulated),
        "Magnitude of the friction coefficient over frequency: median, and the band that holds "
        "90 % of the posterior, of each run that has it.",
        f"Friction over frequency of {len(runs)} runs",
        _numbers(runs),
    )


def _numbers(runs: list[Run]) -> Columns:
    out: dict[str, np.ndarray] = {}
    for run in runs:
        assert run.friction is not None
        out[f"frequency, {run.name} [Hz]"] = run.friction.frequency
        for level, row in zip(QUANTILES, run.friction.magnitude, strict=True):
            out[f"|mu| {level} %, {run.name} [N s/m]"] = row
    return out


def _figure(runs: list[Run], simulated: bool) -> Figure:
    with house_style():
        figure = new_figure(3.8, simulated)
        axes = figure.add_subplot()
        for number, run in enumerate(runs):
            assert run.friction is not None
            colour = ENSEMBLES[number % len(ENSEMBLES)]
            q05, _, median, _, q95 = run.friction.magnitude
            style = ("-", "--", "-.", ":")[number % 4]
            frequency = run.friction.frequency
            axes.fill_between(frequency, q05, q95, color=colour, alpha=0.2, linewidth=0)
            axes.plot(frequency, median, color=colour, linestyle=style, label=run.name)
        axes.set(xscale="log", yscale="log", xlabel="frequency [Hz]", ylabel=r"$|\mu|$ [N·s/m]")
        axes.legend(loc="best")
    return figure
