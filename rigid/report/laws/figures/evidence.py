"""Friction models side by side: evidence of each, and what each left-out record says."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid.plots.figure import Columns, Drawn
from rigid.plots.style import BLUE, ENSEMBLES, GREY, house_style, new_figure, panel_title
from rigid.report.content import FoundContent

PLACE = "odds"
Model = Mapping[str, Any]
"""An entry of `laws` in laws.json."""

LINEAR_TO = 4.0
"""Nats up to which the scale is linear; beyond it is logarithmic."""


def drawn(content: FoundContent) -> Iterator[Drawn]:
    """The figure."""
    models = content.found["laws"]
    yield Drawn(
        "evidence",
        _figure(models, content.simulated),
        "Friction models against the first. Above: evidence, with the priors as stated and "
        "otherwise. Below: what each record says when all others predict it, with the error that "
        "simulated campaigns give.",
        "Evidence of every friction model, and differences record by record",
        numbers(models),
    )


def numbers(models: Sequence[Model]) -> Columns:
    """Evidence of every model under every prior, then differences by record."""
    columns = {"model": np.array([one["words"] for one in models])}
    for prior in models[0]["priors"]:
        told = [one["priors"][prior]["log_evidence"] for one in models]
        columns[f"ln evidence, {prior}"] = np.array(told, dtype=float)
    columns["left-out record"] = np.array([one["record"] for one in models[0]["records"]])
    for one in models[1:]:
        columns[f"ln density, {one['words']}"] = _by_record(one, "elpd_difference")
        columns[f"error, {one['words']}"] = _by_record(one, "elpd_error")
    return columns


def _by_record(model: Model, name: str) -> np.ndarray:
    return np.array([one[name] for one in model["records"]], dtype=float)


def _figure(models: Sequence[Model], simulated: bool) -> Figure:
    """Evidence of every model above, differences record by record below."""
    records = [one["record"] for one in models[0]["records"]]
    tall = 1.0 + 0.2 * len(models), 0.8 + 0.25 * len(records)
    with house_style():
        figure = new_figure(sum(tall) + 0.8, simulated)
        above, below = figure.subplots(2, 1, height_ratios=tall)
        rows = np.arange(len(models))[::-1]
        for row, one in zip(rows, models, strict=True):
            stated, *others = (told["log_evidence"] for told in one["priors"].values())
            above.plot(others, np.full(len(others), row), "|", color=GREY)
            above.plot([stated], [row], "o", color=BLUE, markersize=4)
        above.set_yticks(rows, [one["words"] for one in models])
        above.set_xlabel("ln evidence less that of the first model (ticks: other priors)")
        panel_title(above, "evidence")
        _differences(below, models[1:], records)
        for axes in (above, below):
            axes.set_xscale("symlog", linthresh=LINEAR_TO)
            axes.axvline(0.0, color=GREY, linewidth=0.5)
        return figure


def _differences(axes: Axes, models: Sequence[Model], records: Sequence[str]) -> None:
    """Differences of the log predictive density, with their calibrated errors."""
    rows = np.arange(len(records))[::-1].astype(float)
    for number, one in enumerate(models):
        offset = 0.6 * (0.5 - (number + 0.5) / len(models))
        axes.errorbar(
            _by_record(one, "elpd_difference"), rows + offset, xerr=_by_record(one, "elpd_error"),
            fmt="o", markersize=2.5, linewidth=0.8, color=ENSEMBLES[number % len(ENSEMBLES)],
            label=one["words"],
        )  # fmt: skip
    axes.set_yticks(rows, records)
    axes.set_xlabel("ln predictive density of the left-out record less that by the first model")
    if models:
        axes.legend(fontsize=7)
    panel_title(axes, "left-out records")
