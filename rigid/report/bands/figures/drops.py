"""The greatest falls of the load, seen close."""

import re
from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigid.plots import metrology
from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import GREY, house_style, new_figure, panel_title
from rigid.report.bands.section import COLOURS, FieldShown, columns, legend

MOST_ZOOMS = 4
BEFORE, AFTER = 0.06, 0.12
"""Seconds about a fall that are shown close."""


def drawn(content: FieldShown) -> Iterator[Drawn]:
    """The figure of one test, where its load falls."""
    figure = drops_figure(content, content.simulated)
    if figure is None:
        return
    yield Drawn(
        re.sub(r"[^A-Za-z0-9]+", "-", f"{content.record}-drops"),
        figure,
        "The greatest falls of the load seen close. "
        + ("Dots: what the load cells read. " if content.readings else "")
        + f"Below: {content.words.moved} since the left edge; the band is that of the displacement "
        "itself, so it has width there, too.",
        f"{content.words.load.capitalize()} and displacement about the drops of record "
        f"{content.record}",
        numbers(content),
    )


def numbers(content: FieldShown) -> Columns:
    """Quantiles over time about the falls that are drawn."""
    near = np.zeros(len(content.time), dtype=bool)
    for instant in content.falls[:MOST_ZOOMS]:
        near |= (content.time > instant - BEFORE) & (content.time < instant + AFTER)
    named = (("load", content.loads), ("displacement", content.displacements))
    every = columns(content.time, [(name, band) for name, listed in named for band in listed])
    return {name: values[near] for name, values in every.items()}


def drops_figure(shown: FieldShown, simulated: bool) -> Figure | None:
    """The greatest falls of the load seen close, or None where there is none."""
    instants = sorted(shown.falls[:MOST_ZOOMS])
    if not instants:
        return None
    extent = np.concatenate([b.quantiles[2] for b in shown.loads])
    per_unit, unit = metrology.axis(extent, "N")
    cells = [Line2D([], [], color=GREY, marker=".", linestyle="", label="load cell")]
    with house_style():
        figure = new_figure(5.0, simulated)
        grid = figure.add_gridspec(2, len(instants), height_ratios=(1.3, 1.0))
        for column, instant in enumerate(instants):
            load, below = figure.add_subplot(grid[0, column]), figure.add_subplot(grid[1, column])
            near = (shown.time > instant - BEFORE) & (shown.time < instant + AFTER)
            since = (shown.time[near] - instant) * 1e3
            _close(load, since, [b.quantiles[:, near] * per_unit for b in shown.loads])
            for place, time, values in shown.readings:
                number = [band.place for band in shown.loads].index(place) % len(COLOURS)
                at = (time > instant - BEFORE) & (time < instant + AFTER)
                load.plot(
                    (time[at] - instant) * 1e3, values[at] * per_unit, ".", markersize=4,
                    color=COLOURS[number], markeredgecolor="white", markeredgewidth=0.4, zorder=5,
                )  # fmt: skip
            moved = [b.quantiles[:, near] * 1e3 for b in shown.displacements]
            _close(below, since, [m - m[2, 0] for m in moved])
            panel_title(load, f"t = {instant:.2f} s")
            load.tick_params(labelbottom=False)
            below.set_xlabel("ms")
            if column == 0:
                load.set_ylabel(f"{shown.words.load} [{unit}]")
                below.set_ylabel("displacement since\nthe left edge [mm]")
        figure.legend(
            handles=[*legend(shown.loads), *(cells if shown.readings else [])],
            loc="outside lower center",
            ncols=8,
        )
    return figure


def _close(axes: Axes, time: np.ndarray, bands: Sequence[np.ndarray]) -> None:
    for colour, (q05, q25, median, q75, q95) in zip(cycle(COLOURS), bands, strict=False):
        axes.fill_between(time, q05, q95, color=colour, alpha=0.22, linewidth=0)
        axes.fill_between(time, q25, q75, color=colour, alpha=0.38, linewidth=0)
        axes.plot(time, median, color=colour, linewidth=0.9)
