"""Fig. 11: strokes and displacements of the field test, simulated."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, ORANGE, VERMILION, house_style, new_figure, panel_title
from rigid.report.paper.bands import band_of, line, rounded
from rigid.report.paper.bands import columns as banded
from rigid.report.paper.content import PaperContent

PLACE = "figure-11"


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """Records beside simulations at the left, x_SS beside x_Pl at the right."""
    walk = content.walk
    found: dict[str, np.ndarray] = {"time [s]": walk.simulated.simulated["A"].time}
    for name in ("A", "B"):
        run = walk.simulated.simulated[name]
        step = walk.numbers["stroke_step"].si
        found[f"stroke {name}, read [m]"] = rounded(walk.simulated.recorded[name].stroke[0], step)
        found |= banded(f"x_Pl {name}", "m", run, "plunger")
        found |= banded(f"x_SS {name}", "m", run, "stroke")
    longest = walk.numbers["largest_stroke"].si
    yield Drawn(
        "figure-11",
        _figure(found, longest),
        "Fig. 11 of the paper. Simulated, as Fig. 10. Left: what the stroke sensors would read "
        "(dots) and the displacement of the plungers with a constant κ (lines); those of B part "
        "where its valve was shut. Dashed: the largest stroke of (1), which A passes at 43 s with "
        "the printed κ. Right: x_SS − x_Pl, which is the load over k_LC; the two lie together on "
        "the scale of the left panel, and seven steps of the stroke sensor apart on their own.",
        "Simulated strokes and plunger displacements in the field test, and their difference",
        found,
    )


def _figure(found: Columns, longest: float) -> Figure:
    with house_style():
        figure = new_figure(3.6, simulated=True)
        left, right = figure.subplots(1, 2)
        time = found["time [s]"]
        for name, colour in (("A", BLUE), ("B", VERMILION)):
            label = "x_Pl, constant κ" if name == "A" else "_"
            line(left, time, band_of(found, f"x_Pl {name}", "m") * 1e3, ORANGE, label)
            left.plot(
                time, found[f"stroke {name}, read [m]"] * 1e3, ".", color=colour, markersize=1.8,
                label=f"stroke sensor of {name}",
            )  # fmt: skip
            apart = found[f"x_SS {name} [m]"] - found[f"x_Pl {name} [m]"]
            right.plot(time, apart * 1e3, color=colour, label=f"cylinder {name}")
        left.axhline(
            longest * 1e3, color=GREY, linestyle="--", linewidth=0.9, label="largest stroke"
        )
        left.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(0, 60), ylim=(0, None))
        right.set(xlabel="time [s]", ylabel="x_SS − x_Pl [mm]", xlim=(0, 60))
        panel_title(left, "records and simulation")
        panel_title(right, "stroke less displacement")
        left.legend(loc="upper left", markerscale=3)
        right.legend(loc="upper left")
    return figure
