"""How every figure looks: one set of rcParams, colours that survive colour blindness, the stamp."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser

# Okabe & Ito (2008), colour universal design.
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
RED = "#B00020"  # of what somebody printed, and of nothing else; darker than vermilion
PRINTED = "osD^vP*X"  # marks of what somebody printed, in the order of the values
ORANGE, SKY, PURPLE = "#E69F00", "#56B4E9", "#B05C8E"
INK, GREY, PALE = "#1f2933", "#6b7280", "#d3d8de"
ENSEMBLES = (BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE, INK, GREY)
VALVE = {"open": GREEN, "shut": PALE, "tank": ORANGE}

# Inches: fills the page at 96 px an inch, and is scaled by 0.75 on A4, where 9 pt stay legible.
PAGE_WIDTH = 9.4
STAMP = "SIMULATED DATA"

_RC = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same outlines on every machine
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "mathtext.fontset": "dejavusans",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.7,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "text.color": INK,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "figure.facecolor": "white",
    "hatch.linewidth": 0.5,
    "hatch.color": "#aab2bd",
    "lines.linewidth": 1.1,
    "path.simplify": True,
    "svg.fonttype": "path",
}


@contextmanager
def house_style(**more: object) -> Iterator[None]:
    """The one style, for as long as a figure is drawn or written."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC | more)  # type: ignore[arg-type]
        yield


def new_figure(height: float, simulated: bool) -> Figure:
    """An empty figure as wide as the page, stamped where the data are simulated."""
    figure = Figure(figsize=(PAGE_WIDTH, height), layout="constrained")
    if simulated:
        figure.get_layout_engine().set(rect=(0, 0, 1, 1 - 0.20 / height))  # type: ignore[union-attr]
        stamp(figure)
    return figure


def stamp(figure: Figure) -> None:
    """Says on the figure itself that no rig was measured; a cut-out figure still says so."""
    figure.text(
        *(0.998, 0.998, STAMP),
        ha="right",
        va="top",
        fontsize=8,
        fontweight="bold",
        color=VERMILION,
        in_layout=False,
    )


def tex(symbol: str) -> str:
    """A symbol for a label: as mathematics if it can be set, as plain text if not."""
    upright = re.sub(r"_\{([A-Za-z]{2,})\}", r"_{\\mathrm{\1}}", symbol)
    try:
        MathTextParser("path").parse(f"${upright}$")
    except ValueError:
        return symbol.replace("$", r"\$")
    return f"${upright}$"


def panel_title(axes: Axes, text: str) -> None:
    """A title over the left end of a panel."""
    axes.set_title(text, loc="left")
