"""Fig. 12: sudden drops of the ice load, simulated."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, GREY, ORANGE, VERMILION, house_style, new_figure, panel_title
from rigid.report.paper.bands import band_of, line
from rigid.report.paper.bands import columns as banded
from rigid.report.paper.content import PaperContent

PLACE = "figure-12"
COLOURS = (GREY, BLUE, ORANGE, VERMILION)


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """Loads at the left, displacements of the plate at the right."""
    simulated = content.walk.simulated
    found: dict[str, np.ndarray] = {"time [s]": simulated.drops[0.0].time}
    for alpha, run in simulated.drops.items():
        found[f"ice load, α = {alpha:g} [N]"] = simulated.drop_loads[alpha]
        found |= banded(f"load F_LC, α = {alpha:g}", "N", run, "load")
        found |= banded(f"x_Pl, α = {alpha:g}", "m", run, "plunger")
    yield Drawn(
        "figure-12",
        _figure(found, tuple(simulated.drops)),
        "Fig. 12 of the paper. Simulated: a load of σ_c S_Ice,0 = 157.5 kN on one cylinder loses "
        "20, 40 and 60 % within 10 ms and takes it back in half a second, at κ = 1 and the "
        "friction of (17); when and how fast are choices, as the formula is missing in the text at"
        " hand. Left: F_LC (lines, with bands of the constants) and F_Ice (black, thin). Right: "
        "what the plate moves by beside the run without a drop; the paper finds this very "
        "insignificant.",
        "Simulated loads and displacements of the plate under drops of the ice load",
        found,
    )


def _figure(found: Columns, alphas: tuple[float, ...]) -> Figure:
    with house_style():
        figure = new_figure(3.6, simulated=True)
        left, right = figure.subplots(1, 2)
        time = found["time [s]"]
        still = found["x_Pl, α = 0 [m]"]
        for alpha, colour in zip(alphas, COLOURS, strict=True):
            band = band_of(found, f"load F_LC, α = {alpha:g}", "N")
            line(left, time, band * 1e-3, colour, f"α = {alpha:g}")
            left.plot(
                time, found[f"ice load, α = {alpha:g} [N]"] * 1e-3, color="black", linewidth=0.5
            )
            moved = found[f"x_Pl, α = {alpha:g} [m]"] - still
            right.plot(time, moved * 1e3, color=colour, label=f"α = {alpha:g}")
        left.set(xlabel="time [s]", ylabel="load [kN]", xlim=(0.8, 2.0))
        right.set(xlabel="time [s]", ylabel="move of the plate [mm]", xlim=(0.8, 2.0))
        panel_title(left, "ice load and F_LC")
        panel_title(right, "plate, beside the run without a drop")
        left.legend(loc="lower right")
    return figure
