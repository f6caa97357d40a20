"""Figures of the discovery benchmark: power, reliability, repair, what was said of what."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from discovery_bars import STRONG, alarm, of
from discovery_scores import (
    BINS,
    NOTHING,
    UNNAMED,
    forecasts,
    lower,
    statement,
    true_names,
    upper,
)
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from rigid.plots.style import BLUE, GREY, INK, PALE, VERMILION, house_style, new_figure, panel_title

Row = Mapping
SHOWN_CLOSURE = (-0.5, 1.5)
"""Beyond these the points of the repair stand at the edge: a tiny excess has wild shares."""


def figures(rows: Sequence[Row], folder: Path) -> list[Path]:
    """Write the figures that these rows allow as SVG; returns their paths."""
    written = []
    for name, draw in (("measures", measures), ("confusion", confusion)):
        with house_style(**{"svg.hashsalt": name}):
            figure = draw(rows)
            if figure is not None:
                written.append(folder / f"{name}.svg")
                figure.savefig(written[-1], metadata={"Date": None})
    return written


def measures(rows: Sequence[Row]) -> Figure | None:
    """Power over strength, share right over stated probability, and repair, side by side."""
    if not of(rows, "single"):
        return None
    figure = new_figure(3.1, simulated=True)
    power, reliability, repair = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 0.8))
    _power(power, of(rows, "single"))
    _reliability(reliability, rows)
    _repair(repair, [row["closure"] for row in rows if row.get("closure")])
    return figure


def _shares(axes: Axes, x: np.ndarray, hits: Sequence[tuple[int, int]], colour: str, label: str):
    """Shares with their one-sided 95 % bounds on either side."""
    share = np.array([count / total for count, total in hits])
    low = share - [lower(*one) for one in hits]
    high = np.array([upper(*one) for one in hits]) - share
    axes.errorbar(x, share, (low, high), fmt="o-", ms=3.5, lw=1, color=colour, label=label)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.set_ylim(-0.03, 1.03)


def _power(axes: Axes, rows: Sequence[Row]) -> None:
    strengths = np.array(sorted({row["case"]["strength"] for row in rows}))

    def hits(true: Callable[[Row], bool]) -> list[tuple[int, int]]:
        groups = [[r for r in rows if r["case"]["strength"] == s] for s in strengths]
        return [(sum(map(true, group)), len(group)) for group in groups]

    _shares(axes, strengths - 0.08, hits(alarm), BLUE, "said to be missing")
    right = hits(lambda row: statement(row["answer"]) in true_names(row))
    _shares(axes, strengths + 0.08, right, VERMILION, "with its name first")
    axes.legend(loc="lower right")
    axes.set_xlabel("strength of the hidden effect")
    panel_title(axes, "One effect hidden: is it found?")


def _reliability(axes: Axes, rows: Sequence[Row]) -> None:
    probability, right = forecasts(rows)
    place = np.minimum((probability * BINS).astype(int), BINS - 1)
    used = np.unique(place)
    stated = np.array([probability[place == i].mean() for i in used])
    hits = [(int(right[place == i].sum()), int(np.sum(place == i))) for i in used]
    axes.plot((0, 1), (0, 1), "--", color=GREY, lw=0.8)
    _shares(axes, stated, hits, BLUE, "")
    for x, (count, total) in zip(stated, hits, strict=True):
        axes.annotate(
            *(f"{total}", (x, upper(count, total))),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            fontsize=7,
            color=GREY,
        )
    axes.set_xlim(0, 1)
    axes.set_ylim(-0.03, 1.08)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.set_xlabel("probability stated (numbers: verdicts)")
    panel_title(axes, "Said first: how often right?")


def _repair(axes: Axes, closures: Sequence[Mapping]) -> None:
    rng = np.random.default_rng(0)
    for at, (key, colour) in enumerate((("named", BLUE), ("placebo", GREY))):
        values = np.array([one[key] for one in closures if one[key] is not None])
        if not len(values):
            continue
        spread = at + rng.uniform(-0.18, 0.18, len(values))
        axes.plot(spread, np.clip(values, *SHOWN_CLOSURE), "o", ms=2.5, color=colour, alpha=0.6)
        axes.plot((at - 0.3, at + 0.3), [np.median(values)] * 2, color=INK, lw=1.8)
    axes.set_xticks((0, 1), ("effect\nthat was named", "placebo"))
    axes.set_xlim(-0.5, 1.5)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.set_ylabel("excess misfit closed")
    panel_title(axes, "Left-out blocks, line: median")


def confusion(rows: Sequence[Row]) -> Figure | None:
    """What was said first, over what was hidden at strength 5 and more."""
    counts = _counts(rows)
    if not counts:
        return None
    said = {name for one in counts.values() for name in one} - {NOTHING, UNNAMED}
    truths = list(counts)
    columns = [NOTHING, *[t for t in truths if t in said]]
    columns += [*sorted(said - set(columns)), UNNAMED]
    table = np.array([[counts[t].get(c, 0) for c in columns] for t in truths])
    figure = new_figure(1.9 + 0.185 * len(truths), simulated=True)
    axes = figure.subplots()
    _matrix(axes, table)
    axes.set_xticks(range(len(columns)), columns, rotation=55, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(truths)), truths)
    axes.set_xlabel("said first")
    panel_title(axes, "Hidden at strength 5 and more, or nothing hidden: campaigns by answer")
    return figure


def _counts(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """Campaigns by truth and first statement: nulls, effects, then what has no entry."""
    found: dict[str, dict[str, int]] = {}
    nulls = (*of(rows, "clean"), *of(rows, "hard"))
    strong = [r for r in of(rows, "single", "taken out", "outside") if _strong(r)]
    for row in (*nulls, *sorted(strong, key=_order)):
        one = found.setdefault(_truth(row), {})
        said = statement(row["answer"])
        one[said] = one.get(said, 0) + 1
    return found


def _strong(row: Row) -> bool:
    return row["case"]["strength"] >= STRONG


def _order(row: Row) -> tuple[bool, bool, str]:
    case = row["case"]
    return case["population"] != "single", case["population"] == "outside", case["hide"][0]


def _truth(row: Row) -> str:
    case = row["case"]
    if not case["hide"]:
        return f"{NOTHING}, {case['population']}"
    no_entry = {"taken out": ", taken out", "outside": ", no entry"}
    return case["hide"][0] + no_entry.get(case["population"], "")


def _matrix(axes: Axes, table: np.ndarray) -> None:
    """Shares of each row as squares, counts in them."""
    share = table / np.maximum(table.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (i, j), count in np.ndenumerate(table):
        if count:
            colour = "white" if share[i, j] > 0.55 else INK
            axes.text(j, i, str(count), ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(np.arange(table.shape[1] + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(table.shape[0] + 1) - 0.5, minor=True)
    axes.grid(which="minor", color=PALE, lw=0.4)
    axes.tick_params(which="both", length=0)
