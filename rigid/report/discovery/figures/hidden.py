"""The hidden force, flow or distortion that would explain the records, with its band."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid.plots import metrology
from rigid.plots.figure import Columns, Drawn
from rigid.plots.shown import HiddenShown
from rigid.plots.style import BLUE, GREY, VERMILION, house_style, new_figure
from rigid.report.discovery.section import DiscoveryContent, numbered

PLACE = "step"


def drawn(content: DiscoveryContent) -> Iterator[Drawn]:
    """One figure a step that has no name."""
    for number, shown in numbered(step.hidden for step in content.steps):
        yield Drawn(
            f"hidden-{number}",
            hidden_figure(shown, content.simulated),
            "What would have to be added to the model for it to explain the records.",
            f"Inferred {shown.name} over {shown.variable}",
            numbers(shown),
        )


def numbers(shown: HiddenShown) -> Columns:
    """Mean, standard deviation and the formula if one fits, in SI."""
    where = np.array(shown.groups) if shown.groups else shown.place
    told = {
        f"{shown.variable} [{shown.variable_unit}]": where,
        f"{shown.name} [{shown.unit}]": shown.mean,
        f"standard deviation [{shown.unit}]": shown.sd,
    }
    if shown.formula is not None:
        told[f"{shown.words} [{shown.unit}]"] = shown.formula
    return told


def hidden_figure(shown: HiddenShown, simulated: bool) -> Figure:
    """A hidden force with its band, and the formula if one fits."""
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
        if shown.formula is not None:
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
    if shown.formula is not None:  # always, over groups
        axes.axhline(shown.formula[0] * up, color=VERMILION, linestyle="--", label=shown.model)
    axes.set_xlim(-0.5, len(shown.groups) - 0.5)
    axes.set_xticks(shown.place, shown.groups)
    axes.set_xlabel(shown.variable)
    axes.set_ylabel(shown.name if shown.unit == "1" else f"{shown.name} [{unit}]")
    axes.legend()
