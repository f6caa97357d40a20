"""What was left over against what an effect explains: the added-variable plot."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, INK, VERMILION, house_style, new_figure, panel_title
from rigid.report.discovery.section import AgainstShown, DiscoveryContent, numbered

PLACE = "step"


def drawn(content: DiscoveryContent) -> Iterator[Drawn]:
    """One figure a step that added an effect."""
    for number, shown in numbered(step.against for step in content.steps):
        yield Drawn(
            f"against-{number}",
            against_figure(shown, content.simulated),
            "What the records leave over, against what the effect explains of it, in classes of "
            "samples that tell about as much each; bars: one standard deviation. Were the effect "
            "not there, the points on the left would lie on the level line; as it is, along the "
            "dashed one. With the effect in the model nothing should be left, on the right.",
            "Left over against explained, without and with the effect",
            numbers(shown),
        )


def numbers(shown: AgainstShown) -> Columns:
    """A row a class, in standard deviations of a sample."""
    return {
        "explained [sd of a sample]": shown.explained,
        "left over without it": shown.before,
        "left over with it": shown.after,
        "standard deviation": shown.sd,
    }


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
