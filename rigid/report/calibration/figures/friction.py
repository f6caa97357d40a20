"""Friction over frequency, and how much of it the records have a say in."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rigid.plots.banded import quantile_columns
from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import FrictionCurve
from rigid.plots.style import (
    BLUE,
    GREEN,
    GREY,
    PRINTED,
    RED,
    house_style,
    new_figure,
    panel_title,
)
from rigid.report.content import CalibrationContent

PLACE = "friction"

_HEIGHT = 5.0
_LOWEST, _HIGHEST = 1e-2, 1e3


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """The figure, where the rig has friction to show."""
    curve = content.friction
    if curve is None:
        return
    printed = " Red marks: values that the paper prints." if curve.published else ""
    yield Drawn(
        "friction",
        friction_figure(curve, content.simulated),
        "Friction coefficient over frequency. Bands hold 50 and 90 % of the posterior. Dashed: "
        "90 % of the prior. Hatched: the records say nothing there, the band is the prior's. Bars "
        f"below: frequencies that the records excite.{printed}",
        "Magnitude, dissipative and storage part of the friction coefficient from 0.01 to 1000 Hz",
        numbers(curve),
    )


def numbers(curve: FrictionCurve) -> Columns:
    """Quantiles over frequency, and the printed values."""
    columns = {"frequency [Hz]": curve.frequency, "informed": curve.informed}
    columns |= quantile_columns("abs mu", "N s/m", curve.magnitude)
    columns |= quantile_columns("Re mu", "N s/m", curve.dissipative)
    columns |= quantile_columns("k_omega", "N/m", curve.storage)
    columns |= quantile_columns("prior abs mu", "N s/m", curve.prior_magnitude)
    if curve.published:
        frequency, value, place = zip(*curve.published, strict=True)
        columns["printed at [Hz]"] = np.array(
            ["steady" if f is None else f"{f:g}" for f in frequency]
        )
        columns["printed abs mu [N s/m]"] = np.array(value)
        columns["printed in"] = np.array(place)
    return columns


def friction_figure(curve: FrictionCurve, simulated: bool) -> Figure:
    """Magnitude of mu at the left with the published values, its two parts at the right."""
    with house_style():
        figure = new_figure(_HEIGHT, simulated)
        layout = [["whole", "loss"], ["whole", "store"]]
        shape = {"width_ratios": (1.25, 1)}
        if curve.excited:
            layout += [["excited", "store"]]
            shape |= {"height_ratios": (1, 0.72, 0.28)}
        panels = figure.subplot_mosaic(layout, gridspec_kw=shape)  # type: ignore[arg-type]
        _magnitude(panels["whole"], curve)
        _part(panels["loss"], curve, curve.dissipative, "dissipative part", r"Re $\mu$ [N·s/m]")
        _part(panels["store"], curve, curve.storage, "storage part", r"$k_\omega$ [N/m]")
        panels["loss"].tick_params(labelbottom=False)
        if curve.excited:
            _excited(panels["excited"], curve)
            panels["whole"].tick_params(labelbottom=False)
        for name in ("store", "excited" if curve.excited else "whole"):
            panels[name].set_xlabel("frequency [Hz]")
        figure.legend(
            handles=_legend(curve), loc="outside lower center", ncols=4, columnspacing=1.6
        )
    return figure


def _positive(values: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    return np.where(values > 0, values, np.nan)


def _frame(axes: Axes, curve: FrictionCurve) -> None:
    axes.set_xscale("log")
    axes.set_xlim(_LOWEST, _HIGHEST)
    for low, high in _silent(curve):
        axes.axvspan(low, high, facecolor="#f1f3f5", hatch="////", edgecolor="#9aa5b1", zorder=0)


def _silent(curve: FrictionCurve) -> list[tuple[float, float]]:
    """Stretches of frequency where only the prior speaks."""
    edges = np.concatenate(
        ([_LOWEST], np.sqrt(curve.frequency[1:] * curve.frequency[:-1]), [_HIGHEST])
    )
    stretches, start = [], None
    for index, informed in enumerate([*curve.informed, True]):
        if not informed and start is None:
            start = index
        if informed and start is not None:
            stretches.append((float(edges[start]), float(edges[index])))
            start = None
    return stretches


def _bands(axes: Axes, curve: FrictionCurve, values: Float[np.ndarray, "5 m"]) -> None:
    if not np.any(values > 0):  # a dashpot stores nothing
        axes.set_yticks([])
        axes.text(
            0.5, 0.5, "none under this law", transform=axes.transAxes, ha="center", va="center",
            color=GREY, bbox={"facecolor": "white", "edgecolor": "none"},
        )  # fmt: skip
        return
    q05, q25, median, q75, q95 = _positive(values)
    for low, high, alpha in ((q05, q95, 0.22), (q25, q75, 0.38)):
        axes.fill_between(curve.frequency, low, high, color=BLUE, alpha=alpha, linewidth=0)
    axes.plot(curve.frequency, median, color=BLUE, linewidth=1.5)
    axes.set_yscale("log")


def _part(axes: Axes, curve: FrictionCurve, values: np.ndarray, title: str, label: str) -> None:
    _frame(axes, curve)
    _bands(axes, curve, values)
    axes.set_ylabel(label)
    panel_title(axes, title)


def _magnitude(axes: Axes, curve: FrictionCurve) -> None:
    _frame(axes, curve)
    for edge in _positive(curve.prior_magnitude[[0, 4]]):
        axes.plot(curve.frequency, edge, color=GREY, linewidth=0.9, linestyle=(0, (4, 2)))
    _bands(axes, curve, curve.magnitude)
    for marker, (frequency, value, _) in zip(PRINTED, curve.published, strict=False):
        at_rest = frequency is None
        place = _LOWEST if at_rest else frequency
        axes.plot(
            *(place, value, marker),
            color=RED,
            markeredgecolor="white",
            markersize=7,
            clip_on=False,
            zorder=5,
        )
    axes.set_ylabel(r"$|\mu|$ [N·s/m]")
    panel_title(axes, "magnitude")


def _excited(axes: Axes, curve: FrictionCurve) -> None:
    """Where the records put their power: one bar a kind of record, lowest frequency first."""
    axes.set_xscale("log")
    axes.set_xlim(_LOWEST, _HIGHEST)
    bands = sorted(curve.excited, key=lambda band: band[1], reverse=True)
    for row, (_, low, high) in enumerate(bands):
        axes.plot([low, high], [row, row], color=GREEN, linewidth=5, solid_capstyle="butt")
    axes.set_yticks(range(len(bands)), [label for label, _, _ in bands])
    axes.set_ylim(-0.6, len(bands) - 0.4)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    panel_title(axes, "excited by")


def _legend(curve: FrictionCurve) -> list[Line2D | Patch]:
    marks = []
    for marker, (frequency, _, label) in zip(PRINTED, curve.published, strict=False):
        where = ", steady (at left edge)" if frequency is None else f", {frequency:g} Hz"
        style = {"color": RED, "linestyle": "", "markersize": 6}
        marks.append(Line2D([], [], marker=marker, label=label + where, **style))
    return [
        Line2D([], [], color=BLUE, label="posterior median"),
        Patch(facecolor=(*to_rgb(BLUE), 0.5), edgecolor=BLUE, linewidth=0.6, label="50 % band"),
        Patch(facecolor=(*to_rgb(BLUE), 0.22), edgecolor=BLUE, linewidth=0.6, label="90 % band"),
        Line2D([], [], color=GREY, linestyle=(0, (4, 2)), label="prior, 90 %"),
        Patch(
            facecolor="#f1f3f5", hatch="//////", edgecolor="#9aa5b1", label="only the prior speaks"
        ),
        *marks,
    ]
