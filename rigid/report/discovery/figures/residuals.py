"""Residuals of the channels that gain most, without and with what was added."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.decimate import line_points
from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, INK, VERMILION, house_style, new_figure, panel_title
from rigid.report.discovery.section import MOST_PANELS, DiscoveryContent, ResidualShown, numbered

PLACE = "step"


def drawn(content: DiscoveryContent) -> Iterator[Drawn]:
    """One figure a step that added an effect."""
    for number, shown in numbered(step.residuals for step in content.steps):
        first = shown[0]
        kind = (
            "Size of each line of frequency in residuals over what the sensors' sheets allow"
            if first.frequencies
            else "Residuals over what the sensors' sheets allow, averaged over "
            f"{first.smoothed} samples"
        )
        taken = "" if first.explained is None else " Black: what the effect takes away."
        yield Drawn(
            f"residuals-{number}",
            residuals_figure(shown, content.simulated),
            f"{kind}, without and with the effect, in one scale. Grey: where it shows.{taken}",
            "Residuals before and after the addition",
            numbers(shown),
        )


def numbers(shown: Sequence[ResidualShown]) -> Columns:
    """Residuals over time or frequency, without and with the effect."""
    out: dict[str, np.ndarray] = {}
    for one in shown[:MOST_PANELS]:
        out[f"{one.name} {'frequency [Hz]' if one.frequencies else 'time [s]'}"] = one.place
        out[f"{one.name} before [1]"], out[f"{one.name} after [1]"] = one.before, one.after
    return out


def residuals_figure(shown: Sequence[ResidualShown], simulated: bool) -> Figure:
    """Residuals of a few channels without and with the effect, in one scale."""
    shown = shown[:MOST_PANELS]
    with house_style():
        figure = new_figure(1.2 + 1.7 * len(shown), simulated)
        grid = figure.add_gridspec(len(shown), 2)
        for row, one in enumerate(shown):
            size = 1.1 * max(float(np.nanmax(np.abs(one.before))), 1e-3)
            for column, (series, word) in enumerate(((one.before, "before"), (one.after, "after"))):
                axes = figure.add_subplot(grid[row, column])
                if one.stretch is not None:
                    axes.axvspan(*one.stretch, color=GREY, alpha=0.15, linewidth=0)
                kept = line_points(series)
                axes.plot(
                    one.place[kept], series[kept], linewidth=0.8,
                    color=VERMILION if column == 0 else BLUE,
                )  # fmt: skip
                axes.axhline(0.0, color=GREY, linewidth=0.5)
                axes.set_ylim(0.0 if one.frequencies else -size, size)
                if column == 0 and one.explained is not None:
                    axes.plot(one.place[kept], one.explained[kept], color=INK, linewidth=0.9)
                panel_title(axes, f"{one.name}, {word}")
                if column == 0:
                    axes.set_ylabel("line / sheet" if one.frequencies else "residual / sheet")
                if row == len(shown) - 1:
                    axes.set_xlabel("frequency [Hz]" if one.frequencies else "time [s]")
    return figure
