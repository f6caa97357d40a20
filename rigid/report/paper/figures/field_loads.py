"""Fig. 10: loads and oil pressures of the field test, simulated."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, ORANGE, VERMILION, house_style, new_figure, panel_title
from rigid.report.paper.bands import band_of, line, rounded
from rigid.report.paper.bands import columns as banded
from rigid.report.paper.content import PaperContent

PLACE = "figure-10"


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """Loads at the left, pressures at the right."""
    walk = content.walk
    run = walk.simulated.simulated["A"]
    found: dict[str, np.ndarray] = {"time [s]": run.time}
    for name in ("A", "B"):
        recorded = walk.simulated.recorded[name]
        steps = {key: walk.numbers[f"{key}_step"].si for key in ("load", "pressure")}
        found[f"load {name}, read [N]"] = rounded(recorded.load[0], steps["load"])
        found[f"pressure {name}, read [Pa]"] = rounded(recorded.pressure[0], steps["pressure"])
        found |= banded(f"pressure {name}", "Pa", walk.simulated.simulated[name], "pressure")
    yield Drawn(
        "figure-10",
        _figure(found),
        "Fig. 10 of the paper. Simulated: the ice load rises from 25 s to 50 s to σ_c S_Ice,0 = "
        "157.5 kN on both cylinders together, 60 % of it on A, and is gone within 10 ms; the shape"
        " and the shares are choices. Left: what the load cells would read. Right: what the gauges"
        " would read (dots, the valve of B shut from 25 to 30 s) and the pressures by (19) to (21)"
        " with a constant κ (lines). Bands: constants within their uncertainty, and any friction "
        "from (17) to (18), as the friction used is not printed.",
        "Simulated loads and oil pressures of both cylinders in the field test",
        found,
    )


def _figure(found: Columns) -> Figure:
    with house_style():
        figure = new_figure(3.6, simulated=True)
        left, right = figure.subplots(1, 2)
        time = found["time [s]"]
        for name, colour, other in (("A", BLUE, ORANGE), ("B", VERMILION, ORANGE)):
            left.plot(
                time, found[f"load {name}, read [N]"] * 1e-3, color=colour, label=f"cylinder {name}"
            )
            label = "constant κ" if name == "A" else "_"
            line(right, time, band_of(found, f"pressure {name}", "Pa") * 1e-5, other, label)
            right.plot(
                time, found[f"pressure {name}, read [Pa]"] * 1e-5, ".", color=colour,
                markersize=1.8, label=f"gauge of {name}",
            )  # fmt: skip
        left.set(xlabel="time [s]", ylabel="load F_LC [kN]", xlim=(0, 60), ylim=(0, None))
        right.set(xlabel="time [s]", ylabel="oil pressure [bar]", xlim=(0, 60), ylim=(0, None))
        panel_title(left, "load cells")
        panel_title(right, "oil pressure")
        left.legend(loc="upper left")
        right.legend(loc="upper left", markerscale=3)
    return figure
