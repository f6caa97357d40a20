"""Fig. 8: acceleration of the plate in the quick release, simulated."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, ORANGE, VERMILION, house_style, new_figure, panel_title
from rigid.report.paper.bands import line
from rigid.report.paper.content import PaperContent

PLACE = "figure-8"


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """The release at two frictions."""
    walk = content.walk
    columns: dict[str, np.ndarray] = {}
    for label, (time, swung) in walk.simulated.release.items():
        columns |= {f"time, μ of {label} [s]": time}
        low, high = np.percentile(swung, (5, 95), axis=0)
        columns |= {
            f"acceleration, μ of {label} [m/s^2]": swung[0],
            f"5 %, μ of {label} [m/s^2]": low,
            f"95 %, μ of {label} [m/s^2]": high,
        }
    period, lasts = (walk.numbers[f"release_{name}"].si for name in ("period", "duration"))
    yield Drawn(
        "figure-8",
        _figure(columns, tuple(walk.simulated.release), period, lasts),
        "Fig. 8 of the paper. Simulated: acceleration of the plate after a release from 6 kN at "
        "1.6 kHz, at the friction of (17) and of (18). Bands: 90 % of the constants. Dotted: every "
        "10 ms; dashed: 40 ms, as printed of the two records. At (17) the plate swings in 13.6 ms "
        "and goes on; at (18) it swings in 10.3 ms, with little friction left. Which friction the "
        "printed numbers allow stands in the section on what the published numbers say.",
        "Simulated acceleration after the release under the two printed friction coefficients",
        columns,
    )


def _figure(columns: Columns, labels: tuple[str, ...], period: float, lasts: float) -> Figure:
    with house_style():
        figure = new_figure(3.6, simulated=True)
        panels = figure.subplots(1, len(labels), sharey=True)
        for axes, label, colour in zip(panels, labels, (BLUE, ORANGE), strict=True):
            band = np.stack(
                [
                    columns[f"{part}, μ of {label} [m/s^2]"]
                    for part in ("acceleration", "5 %", "95 %")
                ]
            )
            for k in range(1, 4):
                axes.axvline(k * period * 1e3, color=GREY, linewidth=0.7, linestyle=":")
            axes.axvline(lasts * 1e3, color=VERMILION, linewidth=0.9, linestyle="--")
            line(axes, columns[f"time, μ of {label} [s]"] * 1e3, band, colour, label)
            axes.set(xlabel="time since the release [ms]", xlim=(0, 60))
            panel_title(axes, f"friction of {label}")
        panels[0].set_ylabel("acceleration [m/s²]")
    return figure
