"""One record: what each sensor read, what the posterior says it read, and what is left over."""

import re
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rigid.plots import metrology
from rigid.plots.banded import quantile_columns
from rigid.plots.decimate import band_points, line_points
from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import ChannelFit
from rigid.plots.style import BLUE, GREY, INK, PALE, VALVE, house_style, new_figure
from rigid.report.content import CalibrationContent

PLACE = "fit"

_HEIGHT = 3.6
_READING = 0.55  # opacity: readings lie over the fit, which shows through
_POSITIONS = {"open": "valve open", "shut": "valve shut", "tank": "valve to tank"}
_READ_SO = (
    " Above: readings and what the posterior says the sensors should read. Bands hold 50 and 90 % "
    "of the posterior. Below: residual one step ahead, divided by the noise on the sensor's sheet; "
    "grey: ± 2. The same in the figures of the other records."
)
# Below this count each sample is a dot; above it the dots run together and a line says the same.
_DOTS_UP_TO = 300
# A valve position narrower than this share of the record is left to the legend.
_ROOM_FOR_A_WORD = 0.12


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """One figure a record and cylinder, in the order of the content."""
    groups: dict[tuple[str, str], list[ChannelFit]] = {}
    for channel in content.fits:
        groups.setdefault((channel.record, channel.cylinder), []).append(channel)
    for number, ((record, cylinder), channels) in enumerate(groups.items()):
        quantities = ", ".join(channel.quantity for channel in channels)
        yield Drawn(
            re.sub(r"[^A-Za-z0-9]+", "-", f"record-{record}-{cylinder}"),
            record_figure(channels, content.simulated),
            f"Record {record}, cylinder {cylinder} ({channels[0].kind})."
            f"{'' if number else _READ_SO}",
            f"Readings, posterior prediction and residuals of {quantities}, record {record}, "
            f"cylinder {cylinder}",
            numbers(channels),
        )


def numbers(channels: Sequence[ChannelFit]) -> Columns:
    """Every sample that was read, not only those that are drawn."""
    columns: dict[str, np.ndarray] = {}
    for one in channels:
        columns[f"{one.quantity} time [s]"] = one.time
        columns[f"{one.quantity} [{one.unit}]"] = one.data
        columns |= quantile_columns(one.quantity, one.unit, one.quantiles)
        columns[f"{one.quantity} residual over sheet [1]"] = one.residual
    return columns


def record_figure(channels: Sequence[ChannelFit], simulated: bool) -> Figure:
    """The channels of one record side by side: valve, reading with bands, residual.

    - channels: of one record and cylinder, at least one
    - simulated: stamps the figure
    """
    with house_style():
        figure = new_figure(_HEIGHT, simulated)
        grid = figure.add_gridspec(3, len(channels), height_ratios=(0.07, 1.0, 0.42))
        for column, channel in enumerate(channels):
            fit = figure.add_subplot(grid[1, column])
            strip = figure.add_subplot(grid[2, column], sharex=fit)
            valve = figure.add_subplot(grid[0, column], sharex=fit)
            factor, unit = _time_axis(channel)
            _fit_panel(fit, channel, factor)
            _residual_strip(strip, channel, factor)
            _valve_bar(valve, channel, factor)
            strip.set_xlabel(f"time [{unit}]")
        figure.legend(
            handles=_legend(channels), loc="outside lower center", ncols=8, columnspacing=1.4
        )
    return figure


def _time_axis(channel: ChannelFit) -> tuple[float, str]:
    return metrology.axis(channel.time, "s")


def _fit_panel(axes: Axes, channel: ChannelFit, time_factor: float) -> None:
    factor, unit = metrology.axis(channel.data, channel.unit)
    time, data = channel.time * time_factor, channel.data * factor
    if time.size <= _DOTS_UP_TO:
        axes.plot(time, data, ".", color=GREY, markersize=3, zorder=4)
    else:
        kept = line_points(data)
        axes.plot(time[kept], data[kept], color=INK, linewidth=0.5, alpha=_READING, zorder=4)
    q05, q25, median, q75, q95 = channel.quantiles * factor
    for low, high, alpha in ((q05, q95, 0.22), (q25, q75, 0.38)):
        axes.fill_between(
            *band_points(time, low, high), color=BLUE, alpha=alpha, linewidth=0, zorder=2
        )
    kept = line_points(median)
    axes.plot(time[kept], median[kept], color=BLUE, linewidth=1.6, zorder=3)
    axes.set_ylabel(f"{channel.quantity} [{unit}]")
    axes.set_xlim(time[0], time[-1])
    axes.tick_params(labelbottom=False)


def _residual_strip(axes: Axes, channel: ChannelFit, time_factor: float) -> None:
    time, residual = channel.time * time_factor, channel.residual
    axes.axhspan(-2, 2, color=PALE, alpha=0.45, linewidth=0)
    axes.axhline(0, color=GREY, linewidth=0.6)
    if time.size <= _DOTS_UP_TO:
        axes.plot(time, residual, ".", color=INK, markersize=2.5)
    else:
        kept = line_points(residual)
        axes.plot(time[kept], residual[kept], color=INK, linewidth=0.45)
    reach = max(4.0, 1.1 * float(np.nanmax(np.abs(residual), initial=0.0)))
    axes.set_ylim(-reach, reach)
    if reach < 8:
        axes.set_yticks((-2, 0, 2))
    axes.set_ylabel("residual\n/ sheet [1]")


def _valve_bar(axes: Axes, channel: ChannelFit, time_factor: float) -> None:
    axes.set_axis_off()
    if not channel.valve:
        return
    end = float(channel.time[-1]) * time_factor
    begin = float(channel.time[0]) * time_factor
    starts = [max(time * time_factor, begin) for time, _ in channel.valve]
    for start, stop, (_, position) in zip(starts, [*starts[1:], end], channel.valve, strict=True):
        axes.axvspan(start, stop, color=VALVE.get(position, PALE), linewidth=0)
        if stop - start > _ROOM_FOR_A_WORD * (end - begin):
            ink = INK if position == "shut" else "white"
            axes.text(
                *(0.5 * (start + stop), 0.45, position),
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="center",
                fontsize=6.5,
                color=ink,
            )


def _legend(channels: Sequence[ChannelFit]) -> list[Line2D | Patch]:
    sensor = Line2D([], [], color=INK, linewidth=0.7, label="sensor")
    if channels[0].time.size <= _DOTS_UP_TO:
        sensor.set(color=GREY, marker=".", linestyle="")
    positions = [p for p in VALVE if any(p == said for c in channels for _, said in c.valve)]
    return [
        sensor,
        Line2D([], [], color=BLUE, linewidth=1.6, label="posterior median"),
        Patch(facecolor=(*to_rgb(BLUE), 0.5), edgecolor=BLUE, linewidth=0.6, label="50 % band"),
        Patch(facecolor=(*to_rgb(BLUE), 0.22), edgecolor=BLUE, linewidth=0.6, label="90 % band"),
        Patch(facecolor=PALE, edgecolor=GREY, linewidth=0.6, label="± 2"),
        *(Patch(color=VALVE[p], linewidth=0, label=_POSITIONS[p]) for p in positions),
    ]
