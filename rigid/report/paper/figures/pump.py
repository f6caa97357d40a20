"""Fig. 3: flow of the pump over pressure, by equation (22)."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Drawn
from rigid.plots.style import BLUE, GREY, ORANGE, VERMILION, house_style, new_figure
from rigid.published.walk.equations import place
from rigid.report.paper.content import PaperContent

PLACE = "figure-3"
LITRES = 6e4
"""l/min in a m^3/s."""


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """The curve; computed, no chart of the maker was read."""
    pressure = np.linspace(0.0, 800e5, 801)
    here = place(content.walk.numbers)
    flow = np.array([here.flow(p) for p in pressure])
    n = {name: one.si for name, one in content.walk.numbers.items()}
    loads = {name: n[name] / n["pushing_area"] for name in ("fast_stage_load", "largest_load")}
    yield Drawn(
        "figure-3",
        _figure(pressure, flow, loads, n["smallest_flow"]),
        "Fig. 3 of the paper: flow of the pump over oil pressure by equation (22), computed. "
        "Dashed: the least flow of (1). Dotted: the pressures of one cylinder at 60 kN, where the "
        "text has the pump change its stage, and at the largest load of 300 kN. The curve keeps "
        "the fast flow up to both. The chart of the pump's maker, of which the paper shows a "
        "picture, is not printed in numbers.",
        "Flow of the pump over pressure: 11.6 l/min up to about 650 bar, 1.7 l/min beyond 750 bar",
        {"pressure [Pa]": pressure, "flow by (22) [m^3/s]": flow},
    )


def _figure(
    pressure: np.ndarray, flow: np.ndarray, loads: dict[str, float], least: float
) -> Figure:
    with house_style():
        figure = new_figure(3.4, simulated=False)
        axes = figure.add_subplot()
        axes.plot(pressure * 1e-5, flow * LITRES, color=BLUE, label="equation (22)")
        axes.axhline(
            least * LITRES, color=ORANGE, linestyle="--", label="least flow of (1), 1.64 l/min"
        )
        names = {"fast_stage_load": "60 kN on one cylinder", "largest_load": "300 kN"}
        for (name, value), colour in zip(loads.items(), (GREY, VERMILION), strict=True):
            axes.axvline(value * 1e-5, color=colour, linestyle=":", label=names[name])
        axes.set(xlabel="oil pressure [bar]", ylabel="flow [l/min]", xlim=(0, 800), ylim=(0, 13))
        axes.legend(loc="center", bbox_to_anchor=(0.45, 0.5))
    return figure
