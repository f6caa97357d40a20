"""Fig. 4 of the paper with the roots that each story implies."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import GREEN, GREY, INK, house_style, new_figure, panel_title
from rigid.report.published.section import COLOURS, COMPUTED, StoriesContent, StoriesShown

PLACE = "figures"


def drawn(content: StoriesContent) -> Iterator[Drawn]:
    """The figure, computed from posteriors; nothing on it is a record."""
    caption = (
        "Fig. 4 of the paper with the posterior of each hypothesis. White marks: roots at "
        "the published values of μ."
    )
    yield Drawn("roots", roots_figure(content.shown), caption, caption, numbers(content.shown))


def numbers(shown: StoriesShown) -> Columns:
    """What is drawn, in SI."""
    return {
        f"{part} y, {name} [1]": take(values)
        for name, values in [*shown.printed_roots, *((s.title, s.root) for s in shown.stories)]
        for part, take in (("Re", np.real), ("Im", np.imag))
    }


def roots_figure(shown: StoriesShown) -> Figure:
    """Fig. 4: the roots of (14) as printed, and where each story puts the oscillation."""
    with house_style():
        figure = new_figure(4.6, simulated=False)
        axes = figure.add_subplot()
        for path in shown.path:
            axes.plot(np.real(path), np.imag(path), ".", color=GREY, markersize=1.5)
        axes.plot([], [], color=GREY, label="eq. (14), μ from 0 to 10⁷")
        for (name, roots), marker in zip(shown.printed_roots, "osDv", strict=False):
            axes.plot(
                np.real(roots), np.imag(roots), marker, color="white", markeredgecolor=INK,
                markersize=6, label=name, zorder=6,
            )  # fmt: skip
        for colour, story in zip(COLOURS, shown.stories, strict=False):
            axes.plot(
                np.real(story.root), np.imag(story.root), ".", color=colour, markersize=2,
                alpha=0.5, rasterized=True,
            )  # fmt: skip
            axes.plot([], [], ".", color=colour, label=story.title)
        axes.set(xlim=(0.55, 1.2), ylim=(-0.01, 0.25))
        axes.set(xlabel="Re y = Re ω/ω₀ [1]", ylabel="Im y [1]")
        middle = 2 * np.pi / (shown.omega_0 * shown.period)
        low, high = middle / 1.05, middle / 0.95
        axes.axvspan(low, high, color=GREEN, alpha=0.12, linewidth=0, label="10 ms ± 5 %")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0)
        panel_title(axes, f"Posterior draws of the strongest oscillation ({COMPUTED})")
    return figure
