"""What is left of every channel: does it remember itself, and is it normal."""

from collections.abc import Iterator, Sequence
from statistics import NormalDist

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import ChannelFit
from rigid.plots.style import (
    BLUE,
    GREEN,
    GREY,
    PALE,
    PURPLE,
    VERMILION,
    house_style,
    new_figure,
    panel_title,
)
from rigid.report.content import CalibrationContent

PLACE = "fit"
COLOURS = {"load": BLUE, "stroke": VERMILION, "pressure": GREEN}
MOST_QUANTILES = 60
"""Points of a channel in the plot of quantiles: more lie on each other."""


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """The figure, where there are records."""
    if not content.fits:
        return
    yield Drawn(
        "residuals",
        residuals_figure(content.fits, content.simulated),
        "Residuals of all channels. Shaded: from the least to the greatest of the channels of a "
        "quantity; line: the channel that goes farthest. Left: autocorrelation of readings less "
        "the posterior median; middle: of the residuals one step ahead, which the noise model "
        "takes for independent. Both are divided by 1/√n, the standard error where nothing is "
        "correlated: of independent residuals 19 in 20 lie in the grey band. Right, a line a "
        "channel: quantiles of the residuals one step ahead, over their own standard deviation, "
        "against those of a normal law; rounding makes steps.",
        "Autocorrelation before and after the noise model, and normal quantiles, of all channels",
        numbers(content.fits),
    )


def numbers(fits: Sequence[ChannelFit]) -> Columns:
    """Autocorrelations by lag, and quantiles against normal ones."""
    out: dict[str, np.ndarray] = {"lag": np.arange(1, 1 + fits[0].autocorrelation.shape[1])}
    for one in fits:
        name = f"{one.record} {one.cylinder} {one.quantity}"
        out[f"{name} autocorrelation, raw"] = one.autocorrelation[0]
        out[f"{name} autocorrelation, one step ahead"] = one.autocorrelation[1]
        out[f"{name} normal quantile"], out[f"{name} quantile"] = _quantiles(one.residual)
    return out


def residuals_figure(fits: Sequence[ChannelFit], simulated: bool) -> Figure:
    """Autocorrelation before and after the noise model, and normal quantiles."""
    with house_style():
        figure = new_figure(3.0, simulated)
        grid = figure.add_gridspec(1, 3)
        left = figure.add_subplot(grid[0])
        panels = (left, figure.add_subplot(grid[1], sharey=left), figure.add_subplot(grid[2]))
        for row, (axes, title) in enumerate(
            zip(panels[:2], ("raw", "one step ahead"), strict=True)
        ):
            _correlation(axes, fits, row)
            panel_title(axes, f"autocorrelation, {title}")
        _normal(panels[2], fits)
        seen = [q for q in dict.fromkeys(one.quantity for one in fits)]
        handles: list[Line2D | Patch] = [Line2D([], [], color=_colour(q), label=q) for q in seen]
        handles.append(Patch(facecolor=PALE, edgecolor=GREY, linewidth=0.5, label="± 2"))
        figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _colour(quantity: str) -> str:
    return COLOURS.get(quantity, PURPLE)


def _correlation(axes: Axes, fits: Sequence[ChannelFit], row: int) -> None:
    axes.axhspan(-2, 2, color=PALE, alpha=0.6, linewidth=0)
    lag = np.arange(1, 1 + fits[0].autocorrelation.shape[1])
    for quantity in dict.fromkeys(one.quantity for one in fits):
        values = np.array(
            [
                one.autocorrelation[row] * np.sqrt(one.time.size)
                for one in fits
                if one.quantity == quantity
            ]
        )
        color = _colour(quantity)
        axes.fill_between(
            lag, values.min(axis=0), values.max(axis=0), color=color, alpha=0.15, linewidth=0
        )
        worst = values[np.abs(values).max(axis=1).argmax()]
        axes.plot(lag, worst, color=color, linewidth=0.8)
    axes.set_xlabel("lag [samples]")
    axes.set_ylabel("autocorrelation / standard error [1]")


def _normal(axes: Axes, fits: Sequence[ChannelFit]) -> None:
    reach = 3.5
    axes.plot([-reach, reach], [-reach, reach], color=GREY, linewidth=0.7, linestyle="--")
    for one in fits:
        expected, found = _quantiles(one.residual)
        axes.plot(expected, found, color=_colour(one.quantity), linewidth=0.7)
    axes.set_xlim(-reach, reach)
    axes.set_xlabel("normal quantile [1]")
    axes.set_ylabel("residual / its sd [1]")
    panel_title(axes, "quantiles")


def _quantiles(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normal quantiles, and those of a series over its standard deviation."""
    known = residual[np.isfinite(residual)]
    count = min(known.size, MOST_QUANTILES)
    at = (np.arange(count) + 0.5) / count
    expected = np.array([NormalDist().inv_cdf(float(p)) for p in at])
    return expected, np.quantile(known, at) / (known.std() or 1.0)
