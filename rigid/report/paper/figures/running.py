"""Fig. 9: strokes and oil pressures out of load, simulated."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, VERMILION, house_style, new_figure, panel_title
from rigid.report.paper.bands import band_of, line, rounded
from rigid.report.paper.bands import columns as banded
from rigid.report.paper.content import PaperContent

PLACE = "figure-9"
COLOURS = {"A": BLUE, "B": VERMILION}


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """Both cylinders."""
    walk = content.walk
    found: dict[str, np.ndarray] = {"time [s]": walk.simulated.running["A"].time}
    for name, run in walk.simulated.running.items():
        found |= banded(f"stroke {name}", "m", run, "stroke")
        found |= banded(f"pressure {name}", "Pa", run, "pressure")
        found[f"stroke {name}, read [m]"] = rounded(run.stroke[0], walk.numbers["stroke_step"].si)
        found[f"pressure {name}, read [Pa]"] = rounded(
            run.pressure[0], walk.numbers["pressure_step"].si
        )
    yield Drawn(
        "figure-9",
        _figure(found),
        "Fig. 9 of the paper. Simulated: strokes and oil pressures without a load on the plate at "
        "the friction of (18), read in steps of 0.22 mm and 5 psi. The speeds are not printed; "
        "they are those of the κ of the field test, 0.2 and 0.12, and the bands hold 90 % of a "
        "factor of 1.5 (1 sd) on them.",
        "Simulated strokes and pressures of both cylinders in free running",
        found,
    )


def _figure(found: Columns) -> Figure:
    with house_style():
        figure = new_figure(3.6, simulated=True)
        panels = figure.subplots(1, 2)
        parts = (
            ("stroke", "m", 1e3, "stroke [mm]"),
            ("pressure", "Pa", 1e-5, "oil pressure [bar]"),
        )
        for axes, (quantity, unit, factor, label) in zip(panels, parts, strict=True):
            for name, colour in COLOURS.items():
                band = band_of(found, f"{quantity} {name}", unit, ", read") * factor
                line(axes, found["time [s]"], band, colour, f"cylinder {name}")
            axes.set(xlabel="time [s]", ylabel=label, xlim=(0, 10), ylim=(0, None))
            panel_title(axes, quantity)
        panels[0].legend(loc="upper left")
    return figure
