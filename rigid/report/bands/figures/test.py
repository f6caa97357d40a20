"""A test as a whole: load, displacement, kappa, and what the uncertainty is made of."""

import re
from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid.plots import metrology
from rigid.plots.decimate import band_points, line_points
from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import (
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    house_style,
    new_figure,
)
from rigid.report.bands.section import COLOURS, Banded, FieldShown, columns, legend

# None of those of the cylinders, which are drawn above.
PART_COLOURS = (SKY, GREY, GREEN, PURPLE, ORANGE)
MOST_ROWS = 2000
LEAST_SHARE = 1e-5
"""Of the greatest load, below which a part of its uncertainty is not shown: 1 N on the rig."""


def drawn(content: FieldShown) -> Iterator[Drawn]:
    """The figure of one test."""
    words, flows = content.words, bool(content.kappas)
    moved = "Dotted: movements of the valve found in the record. " if flows else ""
    shown = f"{words.load}, {words.moved} and κ" if flows else f"{words.load} and {words.moved}"
    yield Drawn(
        re.sub(r"[^A-Za-z0-9]+", "-", content.record),
        field_figure(content, content.simulated),
        f"Record {content.record}: {shown}, median with the bands that hold 50 and 90 %. {moved}"
        "Below: what the uncertainty of the load is made of, as standard deviations.",
        f"{shown[0].upper()}{shown[1:]} over time with bands, record {content.record}",
        numbers(content),
    )


def numbers(content: FieldShown) -> Columns:
    """Quantiles and parts over time, MOST_ROWS to twice as many; `bands/<record>.csv` has all."""
    named = (
        ("load", content.loads),
        ("displacement", content.displacements),
        ("kappa", content.kappas),
    )
    out = columns(content.time, [(name, band) for name, listed in named for band in listed])
    out |= {f"load, sd by {name} [N]": sd for name, sd in content.parts}
    every = max(1, len(content.time) // MOST_ROWS)
    return {name: values[::every] for name, values in out.items()}


def field_figure(shown: FieldShown, simulated: bool) -> Figure:
    """The whole test: load, displacement, kappa, and what the load's uncertainty is made of."""
    with house_style():
        heights = {"load": 1.2, "moved": 1.0} | ({"kappa": 0.8} if shown.kappas else {})
        heights["parts"] = 1.0
        figure = new_figure(7.6 * sum(heights.values()) / 4.0, simulated)
        grid = figure.add_gridspec(len(heights), 1, height_ratios=tuple(heights.values()))
        panels = {name: figure.add_subplot(grid[row]) for row, name in enumerate(heights)}
        for axes in panels.values():
            if axes is not panels["load"]:
                axes.sharex(panels["load"])
        _bands(panels["load"], shown.time, shown.loads, shown.words.load)
        _bands(panels["moved"], shown.time, shown.displacements, shown.words.displacement)
        panels["load"].legend(handles=legend(shown.loads), loc="upper left", ncols=5)
        if shown.kappas:
            _flows(panels["kappa"], shown)
        _parts(panels["parts"], shown)
        panels["parts"].set_xlabel("time [s]")
        panels["load"].set_xlim(shown.time[0], shown.time[-1])
        for axes in panels.values():
            axes.tick_params(labelbottom=axes is panels["parts"])
    return figure


def _flows(axes: Axes, shown: FieldShown) -> None:
    """What the valves passed, and when they moved."""
    _bands(axes, shown.time, shown.kappas, "κ")
    at = [band.place for band in shown.kappas]
    if at != [band.place for band in shown.loads][: len(at)]:
        handles = legend(shown.kappas)[: len(at)]
        axes.legend(handles=handles, loc="upper left", ncols=5)
    for place, instant in shown.turns:
        axes.axvline(
            instant, color=COLOURS[at.index(place) % len(COLOURS)], linewidth=0.6, linestyle=":"
        )


def _bands(axes: Axes, time: np.ndarray, bands: Sequence[Banded], name: str) -> None:
    extent = np.concatenate([b.quantiles[2] for b in bands])
    factor, unit = metrology.axis(extent, bands[0].unit)
    for colour, band in zip(cycle(COLOURS), bands, strict=False):
        q05, q25, median, q75, q95 = band.quantiles * factor
        for low, high, alpha in ((q05, q95, 0.22), (q25, q75, 0.38)):
            axes.fill_between(*band_points(time, low, high), color=colour, alpha=alpha, linewidth=0)
        kept = line_points(median)
        axes.plot(time[kept], median[kept], color=colour, linewidth=0.9)
    low, high = _limits(bands)
    axes.set_ylim(low * factor, high * factor)
    axes.set_ylabel(f"{name} [{unit}]" if unit != "1" else name)


def _limits(bands: Sequence[Banded]) -> tuple[float, float]:
    """Ends of the axis: all medians, and the bands but where they are widest, as at a drop.

    A quantity that stands still is shown on an axis of a tenth of its size, not of its noise.
    """
    ends = np.concatenate([b.quantiles[2] for b in bands])
    low = min(ends.min(), *(np.quantile(b.quantiles[0], 0.05) for b in bands))
    high = max(ends.max(), *(np.quantile(b.quantiles[4], 0.95) for b in bands))
    least = max(0.1 * np.abs(ends).max(), 1e-12)
    margin = max(0.08 * (high - low), 0.5 * (least - (high - low)))
    return float(low - margin), float(high + margin)


def _parts(axes: Axes, shown: FieldShown) -> None:
    peak = max(float(np.abs(band.quantiles[2]).max()) for band in shown.loads)
    least = 10.0 ** np.round(np.log10(max(LEAST_SHARE * peak, 1e-12)))
    greatest = 10.0 * least
    for colour, (name, sd) in zip(PART_COLOURS, shown.parts, strict=False):
        if not np.any(sd > 0.0):
            continue
        kept = line_points(sd)
        axes.plot(shown.time[kept], np.maximum(sd[kept], 1e-3 * least), color=colour, label=name)
        greatest = max(greatest, float(sd.max()))
    axes.set_yscale("log")
    axes.set_ylim(least, 20.0 * greatest)  # room for the legend
    axes.set_ylabel(f"sd of the load,\n{shown.loads[-1].place} [N]")
    axes.legend(loc="upper left", ncols=3)
