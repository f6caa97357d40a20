"""The section on bands: what it is on the page, and its content."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rigid.plots.banded import quantile_columns
from rigid.plots.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILION
from rigid.report.content import Content
from rigid.report.section import Kind
from rigid.smoothing.budget import Line

KIND = Kind("bands", 20, "Load and displacement", "bands.html.j2")

COLOURS = (BLUE, VERMILION, INK, GREEN, ORANGE, PURPLE, SKY, GREY)
"""Of the cylinders and their sum, or of joints."""


class Words(NamedTuple):
    """What the words for load and displacement are, on axes and in sentences."""

    load: str
    displacement: str
    moved: str


OF_THE_RIG = Words("ice load", "plate", "displacement of the plate")
OF_A_MACHINE = Words("load", "displacement", "displacement")


@dataclass(frozen=True, eq=False)
class Banded:
    """A quantity of one place: 5, 25, 50, 75 and 95 % quantiles [unit]."""

    place: str
    unit: str
    quantiles: Float[np.ndarray, "5 n"]


@dataclass(frozen=True, eq=False)
class FieldShown:
    """A field test.

    - time [s]; loads, displacements, kappas: by place, the total last
    - readings: (place, time [s], load cell [N]) of each cylinder
    - parts: (name, sd of the load [N]) of what the band of the last load is made of
    - falls: instants [s] of falls of the load, the greatest first; turns: of the valve
    - words: for load and displacement
    """

    record: str
    time: Float[np.ndarray, " n"]
    loads: tuple[Banded, ...]
    displacements: tuple[Banded, ...]
    kappas: tuple[Banded, ...]
    readings: tuple[tuple[str, np.ndarray, np.ndarray], ...]
    parts: tuple[tuple[str, Float[np.ndarray, " n"]], ...]
    falls: tuple[float, ...] = ()
    turns: tuple[tuple[str, float], ...] = ()
    simulated: bool = False
    words: Words = OF_THE_RIG


def columns(time: np.ndarray, quantities: Sequence[tuple[str, Banded]]) -> dict[str, np.ndarray]:
    """Quantiles over time, as columns.

    - `time` [s]. - `quantities`: (name, bands).
    """
    out = {"time [s]": time}
    for name, band in quantities:
        out |= quantile_columns(f"{name} {band.place}", band.unit, band.quantiles)
    return out


def legend(bands: Sequence[Banded]) -> list[Line2D | Patch]:
    """A line for each place, and what the bands hold."""
    lines: list[Line2D | Patch] = [
        Line2D([], [], color=colour, label=band.place)
        for colour, band in zip(cycle(COLOURS), bands, strict=False)
    ]
    return [
        *lines,
        Patch(facecolor=(*to_rgb(GREY), 0.6), edgecolor=GREY, linewidth=0.6, label="50 % band"),
        Patch(facecolor=(*to_rgb(GREY), 0.3), edgecolor=GREY, linewidth=0.6, label="90 % band"),
    ]


@dataclass(frozen=True, eq=False)
class FieldContent:
    """One field test.

    - record: its name; budget: its rows
    - events: sentences on falls of the load and movements of the valve
    - files: (name, what it holds) written for it
    """

    record: str
    budget: tuple[Line, ...]
    events: tuple[str, ...]
    files: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class BandsContent(Content):
    """The section on bands, complete.

    - `heads`: names of the parts of the budget.
    - `draws`: of all laws together; `laws`: how many there are; `posterior`: files of the draws.
    - `machine`: whether it is a machine of the spec's own, not the rig.
    """

    heads: tuple[str, ...]
    records: tuple[FieldContent, ...]
    draws: int
    laws: int
    posterior: str
    machine: bool
