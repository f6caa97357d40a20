"""What published numbers allow: evidence of stories, and Figs. 4, 8 and 9 of the paper with bands.

Nothing here is measured: bands are computed from posteriors, and numbers that the paper prints are
drawn as marks.
"""

from dataclasses import dataclass
from textwrap import fill

import numpy as np
from jaxtyping import Complex, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigid.plots.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    house_style,
    new_figure,
    panel_title,
)

COLOURS = (INK, GREY, SKY, PURPLE, BLUE, GREEN, VERMILION, ORANGE, "#7a5c00", "#8aa29e")
COMPUTED = "computed, not measured"


@dataclass(frozen=True, eq=False)
class StoryShown:
    """A story as the figures need it.

    - `key`, `title`. - `factors`: (ln Bayes factor, Monte Carlo error) by prior.
    - `root` (n,): omega/omega_0 of the strongest oscillation in draws.
    - `acceleration` (5, times) [m/s^2]: quantiles of what the accelerometer would record.
    """

    key: str
    title: str
    factors: tuple[tuple[str, float, float], ...]
    root: Complex[np.ndarray, " n"]
    acceleration: Float[np.ndarray, "5 times"]


@dataclass(frozen=True, eq=False)
class CauseShown:
    """A cause of the pressure in free running: p (5, speeds) [Pa], quantiles, by cylinder."""

    title: str
    pressure: tuple[tuple[str, Float[np.ndarray, "5 speeds"]], ...]


@dataclass(frozen=True, eq=False)
class StoriesShown:
    """All that the figures show.

    - `time` [s]: of the accelerations; `period` [s], `duration` [s]: as printed.
    - `omega_0` [rad/s]: below eq. (14). - `path` (roots, m): of eq. (14) as printed while mu grows;
      `printed_roots`: by name.
    - `speeds` [m/s]; `borrowed`: (cylinder, speed, p) from the printed kappa and mu.
    - `stroke`: (cylinder, (5, times) [m]) over `run_time` [s].
    """

    stories: tuple[StoryShown, ...]
    time: Float[np.ndarray, " times"]
    period: float
    duration: float
    omega_0: float
    path: Complex[np.ndarray, "roots m"]
    printed_roots: tuple[tuple[str, Complex[np.ndarray, " k"]], ...]
    speeds: Float[np.ndarray, " speeds"]
    causes: tuple[CauseShown, ...]
    borrowed: tuple[tuple[str, float, float], ...]
    run_time: Float[np.ndarray, " run"]
    stroke: tuple[tuple[str, Float[np.ndarray, "5 run"]], ...]


def evidence_figure(shown: StoriesShown) -> Figure:
    """ln Bayes factor of each story under both priors."""
    with house_style():
        figure = new_figure(3.6, simulated=False)
        axes = figure.add_subplot()
        rows = np.arange(len(shown.stories))[::-1]
        styles = ((BLUE, "o", 0.12), (ORANGE, "s", -0.12))
        for row, story in zip(rows, shown.stories, strict=True):
            for (_, value, error), (colour, marker, shift) in zip(
                story.factors, styles, strict=True
            ):
                axes.errorbar(
                    value, row + shift, xerr=2 * error, color=colour, marker=marker, markersize=5
                )
        for (name, _, _), (colour, marker, _) in zip(shown.stories[0].factors, styles, strict=True):
            axes.plot([], [], color=colour, marker=marker, linestyle="", label=f"{name} prior")
        axes.axvline(0.0, color=GREY, linewidth=0.6)
        axes.set_yticks(rows, [s.title for s in shown.stories])
        axes.set_xlabel("ln Bayes factor against one constant μ (bars: 2 Monte Carlo errors)")
        axes.legend(loc="lower left")
    return figure


def roots_figure(shown: StoriesShown) -> Figure:
    """Fig. 4: the roots of (14) as printed, and where each story puts the oscillation."""
    with house_style():
        figure = new_figure(4.6, simulated=False)
        axes = figure.add_subplot()
        for path in shown.path:
            axes.plot(np.real(path), np.imag(path), ".", color=GREY, markersize=1.5)
        axes.plot([], [], color=GREY, label="eq. (14), μ from 0 to 10⁷")
        for (name, roots), marker in zip(shown.printed_roots, "osDv", strict=False):
            axes.plot(
                np.real(roots), np.imag(roots), marker, color="white", markeredgecolor=INK,
                markersize=6, label=name, zorder=6,
            )  # fmt: skip
        for colour, story in zip(COLOURS, shown.stories, strict=False):
            axes.plot(
                np.real(story.root), np.imag(story.root), ".", color=colour, markersize=2,
                alpha=0.5, rasterized=True,
            )  # fmt: skip
            axes.plot([], [], ".", color=colour, label=story.title)
        axes.set(xlim=(0.55, 1.2), ylim=(-0.01, 0.25))
        axes.set(xlabel="Re y = Re ω/ω₀ [1]", ylabel="Im y [1]")
        middle = 2 * np.pi / (shown.omega_0 * shown.period)
        low, high = middle / 1.05, middle / 0.95
        axes.axvspan(low, high, color=GREEN, alpha=0.12, linewidth=0, label="10 ms ± 5 %")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0)
        panel_title(axes, f"Posterior draws of the strongest oscillation ({COMPUTED})")
    return figure


def release_figure(shown: StoriesShown) -> Figure:
    """Fig. 8: what the accelerometer would record under each story."""
    columns = 3
    rows = -(-len(shown.stories) // columns)
    with house_style():
        figure = new_figure(1.9 * rows + 0.4, simulated=False)
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for colour, axes, story in zip(COLOURS, panels, shown.stories, strict=False):
            _banded(axes, shown.time * 1e3, story.acceleration, colour)
            for k in range(4):
                axes.axvline(k * shown.period * 1e3, color=GREY, linewidth=0.7, linestyle=":")
            axes.axvline(shown.duration * 1e3, color=VERMILION, linewidth=0.8, linestyle="--")
            panel_title(axes, story.title)
        for axes in panels[len(shown.stories) :]:
            axes.set_axis_off()
        panels[0].set_xlim(0.0, shown.time[-1] * 1e3)
        figure.supxlabel("time since the release [ms]", fontsize=9)
        figure.supylabel(f"acceleration [m/s²], {COMPUTED}", fontsize=9)
    return figure


def running_figure(shown: StoriesShown) -> Figure:
    """Fig. 9: strokes at borrowed speeds, and the pressure at other speeds under each cause."""
    count = len(shown.causes)
    with house_style():
        figure = new_figure(5.2, simulated=False)
        grid = figure.add_gridspec(2, count)
        top = figure.add_subplot(grid[0, :])
        for colour, (name, band) in zip((BLUE, VERMILION), shown.stroke, strict=True):
            _banded(top, shown.run_time, band * 1e3, colour)
            top.plot([], [], color=colour, label=f"cylinder {name}")
        top.set(xlabel="time [s]", ylabel="stroke [mm]", xlim=(0, shown.run_time[-1]))
        top.legend(loc="upper left")
        panel_title(top, f"Stroke if κ is about that of the field test ({COMPUTED})")
        first = None
        for column, cause in enumerate(shown.causes):
            axes = figure.add_subplot(grid[1, column], sharey=first)
            first = first or axes
            for colour, (_, band) in zip((BLUE, VERMILION), cause.pressure, strict=True):
                _banded(axes, shown.speeds * 1e3, band * 1e-5, colour)
            for colour, (_, speed, pressure) in zip((BLUE, VERMILION), shown.borrowed, strict=True):
                axes.plot(speed * 1e3, pressure * 1e-5, "o", color=colour, markeredgecolor="white")
            axes.set_title(fill(cause.title, 26), loc="left", fontsize=7.5)
            axes.set(xlim=(0, shown.speeds[-1] * 1e3), xlabel="speed [mm/s]")
            if column:
                axes.tick_params(labelleft=False)
            else:
                axes.set(ylabel="pressure [bar]", ylim=(0, 150))
        handle = Line2D([], [], marker="o", color=GREY, linestyle="", label="printed μ, borrowed κ")
        figure.legend(handles=[handle], loc="outside lower right")
    return figure


def _banded(axes: Axes, x: np.ndarray, band: np.ndarray, colour: str) -> None:
    q05, q25, median, q75, q95 = band
    axes.fill_between(x, q05, q95, color=colour, alpha=0.2, linewidth=0)
    axes.fill_between(x, q25, q75, color=colour, alpha=0.38, linewidth=0)
    axes.plot(x, median, color=colour, linewidth=0.9)
