"""A field test as a whole: ice load, displacement, kappa, and what the uncertainty is made of."""

import re
from collections.abc import Iterator, Sequence

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
LEAST_SD = 1.0
"""Newtons below which a part of the load's uncertainty is not shown."""


def drawn(content: FieldShown) -> Iterator[Drawn]:
    """The figure of one test."""
    yield Drawn(
        re.sub(r"[^A-Za-z0-9]+", "-", content.record),
        field_figure(content, content.simulated),
        f"Record {content.record}: ice load, displacement of the plate and κ, median with the "
        "bands that hold 50 and 90 %. Dotted: movements of the valve found in the record. Below: "
        "what the uncertainty of the load is made of, as standard deviations.",
        f"Ice load, displacement and kappa over time with bands, record {content.record}",
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
        figure = new_figure(7.6, simulated)
        grid = figure.add_gridspec(4, 1, height_ratios=(1.2, 1.0, 0.8, 1.0))
        panels = [figure.add_subplot(cell) for cell in grid]
        for axes in panels[1:]:
            axes.sharex(panels[0])
        _bands(panels[0], shown.time, shown.loads, "ice load")
        _bands(panels[1], shown.time, shown.displacements, "plate")
        _bands(panels[2], shown.time, shown.kappas, "κ")
        panels[0].legend(handles=legend(shown.loads), loc="upper left", ncols=5)
        for place, instant in shown.turns:
            index = [k.place for k in shown.kappas].index(place)
            panels[2].axvline(instant, color=COLOURS[index], linewidth=0.6, linestyle=":")
        _parts(panels[3], shown)
        panels[3].set_xlabel("time [s]")
        panels[0].set_xlim(shown.time[0], shown.time[-1])
        for axes in panels[:3]:
            axes.tick_params(labelbottom=False)
    return figure


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
