"""What was missing: residuals before and after, what could be told apart, a hidden force."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from rigid.plots import metrology
from rigid.plots.decimate import line_points
from rigid.plots.style import BLUE, GREY, INK, VERMILION, house_style, new_figure, panel_title

MOST_PANELS = 3


@dataclass(frozen=True, eq=False)
class ResidualShown:
    """One channel: residuals over what its sheet allows, before and after.

    - `name`; `place` (n,): time [s]; `before`, `after` (n,): smoothed over `smoothed` samples.
    - `explained` (n,): what the effect takes away, smoothed alike; None where it cannot be drawn.
    - `stretch`: where the effect shows, or None.
    - `frequencies`: whether the places are frequencies [Hz], and the residuals their lines' sizes.
    """

    name: str
    place: Float[np.ndarray, " n"]
    before: Float[np.ndarray, " n"]
    after: Float[np.ndarray, " n"]
    smoothed: int
    explained: Float[np.ndarray, " n"] | None = None
    stretch: tuple[float, float] | None = None
    frequencies: bool = False


@dataclass(frozen=True, eq=False)
class AgainstShown:
    """What was left over against what an effect explains, in classes of samples (m,).

    - `explained`: by the effect, once all else was refitted. - `before`, `after`: left over without
      and with it, mean of the class. - `sd`: that noise alone gives such a mean. All of it in
      what a sample of the sensor scatters by its sheet.
    """

    explained: Float[np.ndarray, " m"]
    before: Float[np.ndarray, " m"]
    after: Float[np.ndarray, " m"]
    sd: Float[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class HiddenShown:
    """A hidden force, flow or distortion against what explains it best.

    - `variable`, `variable_unit`, `name`, `unit`. - `place`, `mean`, `sd` (n,).
    - `formula`: values (n,) of the simplest formula that fits, and its words.
    - `groups`: names of the places where these are no numbers: kinds of records, quantities; then
      the formula is what the model has there, and `model` says it.
    """

    variable: str
    variable_unit: str
    name: str
    unit: str
    place: Float[np.ndarray, " n"]
    mean: Float[np.ndarray, " n"]
    sd: Float[np.ndarray, " n"]
    formula: Float[np.ndarray, " n"]
    words: str
    groups: tuple[str, ...] = ()
    model: str = ""


@dataclass(frozen=True, eq=False)
class ComparedShown:
    """P-values of disagreements between records and predictions.

    - `names`: of the channels. - `over`: what residuals were looked at over.
    - `before`, `after` (channels, over): NaN where there is nothing to look at; `after` is None
      where nothing was added.
    """

    names: tuple[str, ...]
    over: tuple[str, ...]
    before: Float[np.ndarray, "channels over"]
    after: Float[np.ndarray, "channels over"] | None


def compared_figure(shown: ComparedShown, simulated: bool) -> Figure:
    """P-values of all channels, before and after; dark where they disagree beyond chance."""
    tables = [(shown.before, "as specified")]
    if shown.after is not None:
        tables.append((shown.after, "with what was added"))
    with house_style():
        figure = new_figure(max(2.4, 1.4 + 0.17 * len(shown.names)), simulated)
        grid = figure.add_gridspec(1, 2)
        for column, (table, word) in enumerate(tables):
            axes = figure.add_subplot(grid[0, column])
            axes.set_facecolor("0.93")
            image = axes.imshow(table, norm=LogNorm(1e-3, 1.0), cmap="Reds_r", aspect="auto")
            axes.set_xticks(range(len(shown.over)), shown.over, rotation=90)
            axes.set_yticks(range(len(shown.names)), shown.names if column == 0 else ())
            axes.tick_params(length=0)
            panel_title(axes, word)
            if column == len(tables) - 1:
                bar = figure.colorbar(image, ax=axes, shrink=0.7)
                bar.set_label("p-value")
    return figure


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


def against_figure(shown: AgainstShown, simulated: bool) -> Figure:
    """Left over against explained, without and with the effect, in one scale.

    In proportion about 0 and by orders of magnitude further out: a few samples may be explained by
    whole sds, thousands by a tenth each.
    """
    reach = 1.3 * float(np.max(np.abs([shown.explained, shown.before, shown.after]) + shown.sd))
    near = float(np.median(np.abs(shown.explained)))
    ends = np.linspace(-reach, reach, 401)
    panels = (("without it", shown.before, VERMILION), ("with it", shown.after, BLUE))
    with house_style():
        figure = new_figure(3.6, simulated)
        grid = figure.add_gridspec(1, 2)
        for column, (word, means, color) in enumerate(panels):
            axes = figure.add_subplot(grid[0, column])
            axes.axhline(0.0, color=GREY, linewidth=0.5)
            expected = ends if column == 0 else 0.0 * ends
            axes.plot(ends, expected, color=INK, linewidth=0.9, linestyle="--")
            axes.errorbar(
                shown.explained, means, yerr=shown.sd, fmt="o", color=color, markersize=4,
                linewidth=0.9,
            )  # fmt: skip
            axes.set_xscale("symlog", linthresh=near)
            axes.set_yscale("symlog", linthresh=near)
            axes.set_xlim(-reach, reach)
            axes.set_ylim(-reach, reach)
            panel_title(axes, word)
            axes.set_xlabel("what the effect explains [sds of a sample]")
            if column == 0:
                axes.set_ylabel("left over [sds of a sample]")
    return figure


def matrix_figure(
    names: Sequence[str], cosines: Float[np.ndarray, "n n"], simulated: bool
) -> Figure:
    """Cosines of the traces of all effects: 1 and -1 cannot be told apart by size alone."""
    with house_style():
        figure = new_figure(6.4, simulated)
        axes = figure.add_subplot()
        image = axes.imshow(cosines, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
        axes.set_xticks(range(len(names)), names, rotation=90)
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(length=0)
        for i, row in enumerate(cosines):
            for j, value in enumerate(row):
                if i != j and abs(value) >= 0.5:
                    axes.text(
                        j, i, f"{value:.1f}", ha="center", va="center", fontsize=5,
                        color="white" if abs(value) > 0.8 else "black",
                    )  # fmt: skip
        figure.colorbar(image, ax=axes, shrink=0.7, label="cosine of the traces")
    return figure


def hidden_figure(shown: HiddenShown, simulated: bool) -> Figure:
    """A hidden force with its band, and the formula."""
    with house_style():
        figure = new_figure(2.8, simulated)
        axes = figure.add_subplot()
        if shown.groups:
            _by_group(axes, shown)
            return figure
        across, unit_x = metrology.axis(shown.place, shown.variable_unit)
        up, unit_y = metrology.axis(shown.mean, shown.unit)
        x, y, sd = shown.place * across, shown.mean * up, shown.sd * up
        axes.fill_between(x, y - 1.645 * sd, y + 1.645 * sd, color=BLUE, alpha=0.2, linewidth=0)
        axes.plot(x, y, color=BLUE, label="inferred, with 90 % band")
        axes.plot(x, shown.formula * up, color=VERMILION, linestyle="--", label=shown.words)
        axes.axhline(0.0, color=GREY, linewidth=0.5)
        axes.set_xlabel(f"{shown.variable} [{unit_x}]")
        axes.set_ylabel(f"{shown.name} [{unit_y}]")
        axes.legend()
    return figure


def _by_group(axes: Axes, shown: HiddenShown) -> None:
    """A number in every kind of record or for every quantity, beside what the model has there."""
    up, unit = metrology.axis(shown.mean, shown.unit)
    axes.errorbar(
        shown.place, shown.mean * up, yerr=1.645 * shown.sd * up, fmt="o", color=BLUE,
        markersize=4, label="inferred, with 90 % interval",
    )  # fmt: skip
    axes.axhline(shown.formula[0] * up, color=VERMILION, linestyle="--", label=shown.model)
    axes.set_xlim(-0.5, len(shown.groups) - 0.5)
    axes.set_xticks(shown.place, shown.groups)
    axes.set_xlabel(shown.variable)
    axes.set_ylabel(shown.name if shown.unit == "1" else f"{shown.name} [{unit}]")
    axes.legend()
