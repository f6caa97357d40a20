"""A field test: ice load, displacement and kappa with their bands, and the drops seen close."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rigid.plots import metrology
from rigid.plots.decimate import band_points, line_points
from rigid.plots.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
    house_style,
    new_figure,
    panel_title,
)

COLOURS = (BLUE, VERMILION, INK)
PART_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE)
MOST_ZOOMS = 4
BEFORE, AFTER = 0.06, 0.12
"""Seconds about a fall that are shown close."""

LEAST_SD = 1.0
"""Newtons below which a part of the load's uncertainty is not shown."""


@dataclass(frozen=True, eq=False)
class Banded:
    """A quantity of one place: 5, 25, 50, 75 and 95 % quantiles [unit]."""

    place: str
    unit: str
    quantiles: Float[np.ndarray, "5 n"]


@dataclass(frozen=True, eq=False)
class FieldShown:
    """A field test.

    - time [s]; loads, displacements, kappas: by place, the total last
    - readings: (place, time [s], load cell [N]) of each cylinder
    - parts: (name, sd of the load [N]) of what the band of the last load is made of
    - falls: instants [s] of falls of the load, the greatest first; turns: of the valve
    """

    record: str
    time: Float[np.ndarray, " n"]
    loads: tuple[Banded, ...]
    displacements: tuple[Banded, ...]
    kappas: tuple[Banded, ...]
    readings: tuple[tuple[str, np.ndarray, np.ndarray], ...]
    parts: tuple[tuple[str, Float[np.ndarray, " n"]], ...]
    falls: tuple[float, ...] = ()
    turns: tuple[tuple[str, float], ...] = ()


def field_figure(shown: FieldShown, simulated: bool) -> Figure:
    """The whole test: load, displacement, kappa, and what the load's uncertainty is made of."""
    with house_style():
        figure = new_figure(7.6, simulated)
        grid = figure.add_gridspec(4, 1, height_ratios=(1.2, 1.0, 0.8, 1.0))
        panels = [figure.add_subplot(cell) for cell in grid]
        for axes in panels[1:]:
            axes.sharex(panels[0])
        _bands(panels[0], shown.time, shown.loads, "ice load")
        _bands(panels[1], shown.time, shown.displacements, "plate")
        _bands(panels[2], shown.time, shown.kappas, "κ")
        panels[0].legend(handles=_legend(shown.loads), loc="upper left", ncols=5)
        for place, instant in shown.turns:
            index = [k.place for k in shown.kappas].index(place)
            panels[2].axvline(instant, color=COLOURS[index], linewidth=0.6, linestyle=":")
        _parts(panels[3], shown)
        panels[3].set_xlabel("time [s]")
        panels[0].set_xlim(shown.time[0], shown.time[-1])
        for axes in panels[:3]:
            axes.tick_params(labelbottom=False)
    return figure


def drops_figure(shown: FieldShown, simulated: bool) -> Figure | None:
    """The greatest falls of the load seen close, or None where there is none."""
    instants = sorted(shown.falls[:MOST_ZOOMS])
    if not instants:
        return None
    with house_style():
        figure = new_figure(5.0, simulated)
        grid = figure.add_gridspec(2, len(instants), height_ratios=(1.3, 1.0))
        for column, instant in enumerate(instants):
            load, place = figure.add_subplot(grid[0, column]), figure.add_subplot(grid[1, column])
            near = (shown.time > instant - BEFORE) & (shown.time < instant + AFTER)
            since = (shown.time[near] - instant) * 1e3
            _close(load, since, [b.quantiles[:, near] * 1e-3 for b in shown.loads])
            for number, (_, time, values) in enumerate(shown.readings):
                at = (time > instant - BEFORE) & (time < instant + AFTER)
                load.plot(
                    (time[at] - instant) * 1e3, values[at] * 1e-3, ".", markersize=4,
                    color=COLOURS[number], markeredgecolor="white", markeredgewidth=0.4, zorder=5,
                )  # fmt: skip
            moved = [b.quantiles[:, near] * 1e3 for b in shown.displacements]
            _close(place, since, [m - m[2, 0] for m in moved])
            panel_title(load, f"t = {instant:.2f} s")
            load.tick_params(labelbottom=False)
            place.set_xlabel("ms")
            if column == 0:
                load.set_ylabel("ice load [kN]")
                place.set_ylabel("displacement since\nthe left edge [mm]")
        figure.legend(
            handles=[
                *_legend(shown.loads),
                Line2D([], [], color=GREY, marker=".", linestyle="", label="load cell"),
            ],
            loc="outside lower center",
            ncols=8,
        )
    return figure


def _close(axes: Axes, time: np.ndarray, bands: Sequence[np.ndarray]) -> None:
    for colour, (q05, q25, median, q75, q95) in zip(COLOURS, bands, strict=False):
        axes.fill_between(time, q05, q95, color=colour, alpha=0.22, linewidth=0)
        axes.fill_between(time, q25, q75, color=colour, alpha=0.38, linewidth=0)
        axes.plot(time, median, color=colour, linewidth=0.9)


def _bands(axes: Axes, time: np.ndarray, bands: Sequence[Banded], name: str) -> None:
    extent = np.concatenate([b.quantiles[2] for b in bands])
    factor, unit = metrology.axis(extent, bands[0].unit)
    for colour, band in zip(COLOURS, bands, strict=False):
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


def _legend(bands: Sequence[Banded]) -> list[Line2D | Patch]:
    lines: list[Line2D | Patch] = [
        Line2D([], [], color=colour, label=band.place)
        for colour, band in zip(COLOURS, bands, strict=False)
    ]
    return [
        *lines,
        Patch(color=GREY, alpha=0.6, linewidth=0, label="50 %"),
        Patch(color=GREY, alpha=0.3, linewidth=0, label="90 %"),
    ]


def _parts(axes: Axes, shown: FieldShown) -> None:
    greatest = 10.0 * LEAST_SD
    for colour, (name, sd) in zip(PART_COLOURS, shown.parts, strict=False):
        if not np.any(sd > 0.0):
            continue
        kept = line_points(sd)
        axes.plot(shown.time[kept], np.maximum(sd[kept], 1e-3), color=colour, label=name)
        greatest = max(greatest, float(sd.max()))
    axes.set_yscale("log")
    axes.set_ylim(LEAST_SD, 20.0 * greatest)  # room for the legend
    axes.set_ylabel(f"sd of the load,\n{shown.loads[-1].place} [N]")
    axes.legend(loc="upper left", ncols=3)
