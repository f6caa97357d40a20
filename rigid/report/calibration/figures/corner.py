"""Which parameters trade off against which: every pair of the main ones."""

import logging
import warnings
from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from rigid.plots import metrology
from rigid.plots.figure import Drawn
from rigid.plots.shown import ParameterDraws
from rigid.plots.style import BLUE, PAGE_WIDTH, RED, house_style, stamp, tex
from rigid.report.content import CalibrationContent

PLACE = "parameters"
MOST = 5
"""Parameters of the first figure; all are in a second one."""

# Shares of the draws inside the contours, as in the other figures.
_INSIDE = (0.5, 0.9)
_BINS = 28


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """The figure, where there are draws to show."""
    draws = content.draws
    if draws is None:
        return
    yield _drawn("corner", "main", _first(draws, MOST), content.simulated)
    if len(draws.symbols) > MOST:
        yield _drawn("corner-all", "machine's own", draws, content.simulated)


def _drawn(name: str, which: str, draws: ParameterDraws, simulated: bool) -> Drawn:
    """The pairs of some parameters."""
    marked = any(mark is not None for mark in draws.marks)
    printed = " Red lines: values that the paper prints, where they fall inside." if marked else ""
    read_so = (
        f" Contours hold 50 and 90 % of the draws.{printed} A slanted or curved contour is a "
        "trade-off that the records do not settle."
    )
    return Drawn(
        name,
        corner_figure(draws, simulated),
        f"Every pair of the {which} parameters.{read_so if name == 'corner' else ''}",
        f"Joint posterior of pairs of the {which} parameters",
        {
            f"{symbol} [{unit}]": row
            for symbol, unit, row in zip(draws.symbols, draws.units, draws.values, strict=True)
        },
    )


def _first(draws: ParameterDraws, count: int) -> ParameterDraws:
    """The first parameters alone."""
    return ParameterDraws(
        draws.symbols[:count], draws.units[:count], draws.values[:count], draws.marks[:count]
    )


def corner_figure(draws: ParameterDraws, simulated: bool) -> Figure:
    """Histograms on the diagonal, contours that hold 50 and 90 % of the draws below it."""
    with warnings.catch_warnings():
        # corner imports ArviZ, which announces its next version at every import.
        warnings.simplefilter("ignore", FutureWarning)
        import corner

    scales = [
        metrology.axis(np.atleast_1d(row), unit)
        for row, unit in zip(draws.values, draws.units, strict=True)
    ]
    labels = [
        f"{tex(symbol)} [{unit}]" for symbol, (_, unit) in zip(draws.symbols, scales, strict=True)
    ]
    factors = np.array([factor for factor, _ in scales])
    size = min(PAGE_WIDTH, 1.45 * len(labels) + 1.0)
    with house_style(**{"xtick.labelsize": 7, "ytick.labelsize": 7}):
        figure = Figure(figsize=(size, size))
        logging.getLogger("root").addFilter(_quiet)
        try:
            corner.corner(
                (draws.values * factors[:, None]).T,
                fig=figure,
                labels=labels,
                range=[_range(row * f) for row, f in zip(draws.values, factors, strict=True)],
                truths=[
                    None if mark is None else mark * factor
                    for mark, factor in zip(draws.marks, factors, strict=True)
                ],
                **_look((0.99 * size - 0.95) / len(labels)),
            )
        finally:
            logging.getLogger("root").removeFilter(_quiet)
        figure.subplots_adjust(left=0.95 / size, bottom=0.95 / size, right=0.99, top=0.97)
        if simulated:
            stamp(figure)
    return figure


def _quiet(record: logging.LogRecord) -> bool:
    """corner says "Too few points to create valid contours" to the root logger."""
    return "Too few points" not in record.getMessage()


def _range(values: np.ndarray) -> tuple[float, float]:
    """All but the outermost half per cent, so that one stray draw does not shrink the picture."""
    low, high = np.quantile(values, (0.0025, 0.9975))
    margin = 0.08 * (high - low) or 0.5 * abs(high) or 0.5
    return float(low - margin), float(high + margin)


def _look(panel: float) -> dict:
    """How panels `panel` inches wide look; names lie 0.6 inches from the axes, beyond the ticks."""
    return {
        "bins": _BINS,
        "smooth": 1.2,
        "levels": _INSIDE,
        "color": BLUE,
        "truth_color": RED,
        "plot_datapoints": False,
        "plot_density": False,
        "fill_contours": True,
        "max_n_ticks": 3,
        "labelpad": 0.6 / panel - 0.3,  # corner counts from 0.3 panels below an axis
        "hist_kwargs": {"linewidth": 1.1},
        "contour_kwargs": {"linewidths": 0.9},
        "label_kwargs": {"fontsize": 9},
    }
