"""How far each number lies from that of the first run, in its standard deviations."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import ENSEMBLES, GREY, house_style, new_figure
from rigid.report.compare.content import CompareContent
from rigid.report.compare.moved import Move

PLACE = "moved"
MOST = 24
"""Numbers that are drawn, those that moved farthest; all are in the table."""

WIDEST = 15.0
"""Standard deviations at which the axis ends at most."""


def drawn(content: CompareContent) -> Iterator[Drawn]:
    """The figure, where runs have numbers in common."""
    moved = [move for moves in content.compared.moved for move in moves]
    names = list(dict.fromkeys(m.parameter for m in sorted(moved, key=_size)))[:MOST]
    if not names:
        return
    shown = [move for move in moved if move.parameter in names]
    yield Drawn(
        "moved",
        _figure(shown, names, content),
        f"How far each number moved from {content.heads[0]}, in standard deviations of the "
        "difference, or of what is taken for it: the sentence above the table says which. "
        f"{len(names)} numbers that moved farthest; grey: within two. Bars: where the sd of the "
        "difference is not known, down to the least that the move may be. An arrow: farther than "
        "the axis, by the number beside it.",
        f"Standard deviations by which {len(names)} numbers moved",
        _numbers(shown),
    )


def _size(move: Move) -> float:
    return -abs(move.z or 0.0)


def _beyond(axes: Axes, z: float, row: float, colour: str) -> None:
    """Tell of a move that leaves the axis: an arrow at its end, and the number."""
    side = 1.0 if z > 0.0 else -1.0
    axes.plot(
        *(0.5 + 0.49 * side, row, ">" if side > 0.0 else "<"),
        transform=axes.get_yaxis_transform(),
        color=colour,
        markersize=5,
    )
    axes.annotate(
        *(f"{z:+.1f}".replace("-", "\N{MINUS SIGN}"), (0.5 + 0.49 * side, row)),
        xycoords=axes.get_yaxis_transform(),
        xytext=(-7.0 * side, 0.0),
        textcoords="offset points",
        ha="right" if side > 0.0 else "left",
        va="center",
        fontsize=8,
    )


def _numbers(shown: list[Move]) -> Columns:
    return {
        "parameter": np.array([move.parameter for move in shown]),
        "run": np.array([move.run for move in shown]),
        "moved [sd]": np.array([np.nan if move.z is None else move.z for move in shown]),
        "least |z|": np.array([move.bounds[0] if move.bounds else np.nan for move in shown]),
        "most |z|": np.array([move.bounds[1] if move.bounds else np.nan for move in shown]),
    }


def _figure(shown: list[Move], names: list[str], content: CompareContent) -> Figure:
    with house_style():
        figure = new_figure(1.2 + 0.24 * len(names), content.simulated)
        axes = figure.add_subplot()
        axes.axvspan(-2, 2, color=GREY, alpha=0.12, linewidth=0)
        axes.axvline(0, color=GREY, linewidth=0.7)
        most = max(3.0, min(WIDEST, 1.15 * max(abs(m.z or 0.0) for m in shown)))
        for number, run in enumerate(content.heads[1:]):
            colour = ENSEMBLES[number % len(ENSEMBLES)]
            step = 0.5 * (number / (len(content.heads) - 2)) - 0.25 if content.heads[2:] else 0.0
            for move in (m for m in shown if m.run == run):
                row, z = len(names) - 1 - names.index(move.parameter) - step, move.z or 0.0
                if move.bounds:
                    ends = np.clip([np.sign(z) * move.bounds[0], z], -most, most)
                    axes.plot(ends, [row, row], color=colour, linewidth=0.8, alpha=0.6)
                if abs(z) <= most:
                    axes.plot(z, row, "o", color=colour, markersize=4)
                else:
                    _beyond(axes, z, row, colour)
            axes.plot([], [], "o", color=colour, label=run)
        axes.set_yticks(np.arange(len(names))[::-1], names)
        axes.set(xlim=(-most, most), ylim=(-0.7, len(names) - 0.3))
        axes.set_xlabel(f"moved from {content.heads[0]} [standard deviations]")
        figure.legend(loc="outside lower center", ncols=4)
    return figure
