"""Fig. 6: load against stroke in the frame, simulated."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, INK, house_style, new_figure
from rigid.report.paper.bands import rounded
from rigid.report.paper.content import PaperContent

PLACE = "figure-6"


def drawn(content: PaperContent) -> Iterator[Drawn]:
    """The three tests."""
    columns = _columns(content)
    yield Drawn(
        "figure-6",
        _figure(columns),
        "Fig. 6 of the paper. Simulated: three frame tests, with a slack of 0.8, 1.0 and 1.2 mm "
        "before full contact; flow and slack are choices; the file of numbers also has them in "
        "steps of 295 N and 0.22 mm. Band: the middle test for constants within their uncertainty "
        "and k_LC within its rounding. Black: the line that the paper draws, through an offset of "
        "1 mm and 250 kN at 5 mm more.",
        "Load against stroke in three simulated frame tests: flat up to 1 mm, then straight",
        columns,
    )


def _columns(content: PaperContent) -> Columns:
    walk = content.walk
    n = {name: one.si for name, one in walk.numbers.items()}
    out: dict[str, np.ndarray] = {}
    for number, run in enumerate(walk.simulated.frame, start=1):
        out[f"stroke, test {number} [m]"] = run.stroke[0]
        out[f"load, test {number} [N]"] = run.load[0]
        out[f"stroke, test {number}, read [m]"] = rounded(run.stroke[0], n["stroke_step"])
        out[f"load, test {number}, read [N]"] = rounded(run.load[0], n["load_step"])
    middle = walk.simulated.frame[1]
    loads = np.linspace(0.0, n["frame_load"], 60)
    strokes = [
        np.interp(loads, load, stroke)
        for load, stroke in zip(middle.load, middle.stroke, strict=True)
    ]
    low, high = np.percentile(strokes, (5, 95), axis=0)
    out |= {"load of the band [N]": loads, "stroke, 5 % [m]": low, "stroke, 95 % [m]": high}
    line = np.array([n["stroke_offset"], n["stroke_offset"] + n["frame_stroke"]])
    return out | {
        "stroke, line of the paper [m]": line,
        "load, line of the paper [N]": np.array([0.0, n["frame_load"]]),
    }


def _figure(columns: Columns) -> Figure:
    with house_style():
        figure = new_figure(3.8, simulated=True)
        axes = figure.add_subplot()
        low, high = columns["stroke, 5 % [m]"], columns["stroke, 95 % [m]"]
        axes.fill_betweenx(
            columns["load of the band [N]"] * 1e-3, low * 1e3, high * 1e3, color=BLUE, alpha=0.2,
            linewidth=0, label="90 % of the constants, middle test",
        )  # fmt: skip
        axes.plot(
            columns["stroke, line of the paper [m]"] * 1e3,
            columns["load, line of the paper [N]"] * 1e-3,
            color=INK, linewidth=1.4, label="line of the paper",
        )  # fmt: skip
        for number in (1, 2, 3):
            axes.plot(
                columns[f"stroke, test {number} [m]"] * 1e3,
                columns[f"load, test {number} [N]"] * 1e-3,
                color=BLUE, linewidth=0.9,
                label="simulated tests" if number == 1 else None,
            )  # fmt: skip
        axes.set(xlabel="stroke x_SS [mm]", ylabel="load F_LC [kN]", xlim=(0, None), ylim=(0, None))
        axes.legend(loc="upper left")
    return figure
