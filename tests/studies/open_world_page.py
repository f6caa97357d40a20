"""The page of fits in the open world, from its rows: what holds and what breaks, by population."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from rows import OneCode
from scipy.stats import binom

Row = Mapping
LEVEL, BAND = 0.9, 0.95
"""Of the intervals, and of the band in which chance leaves their coverage."""
HEAD = """\
# The open world: fits by population

Campaigns of the [second simulator](populations.md), which shares no code with the package nor with
its generator, fitted as `rigid.fit` does. All of it is simulated. Populations stand apart and are
never mixed. What discovery says of them: [by population](open_world_discovery.md).
"""
COVERAGE = """\
## What intervals hold

How many campaigns in a hundred have the truth in the 90 % interval, and in brackets the root mean
square of the distance from median to truth in posterior sds (1 is right). Fits that are usable
count, campaigns as the unit: kappa and the release time, of which a campaign has several, by the
share of them. *kappa q* is kappa with the truth's pump in place of the model's. In bold what lies
outside the 95 % band of a binomial count.
"""
QUANTITIES = {
    "k_LC": "k_LC", "k_oil": "k_oil", "mu": "mu", "abs mu, 0 Hz": "abs_mu[0.01 Hz]",
    "abs mu, 80 Hz": "abs_mu[80 Hz]", "kappa": "kappa[", "kappa q": "kappa[",
    "release time": "release_time[",
}  # fmt: skip
"""Columns, and how the labels of a fit's table begin."""


class Held(NamedTuple):
    """Of a quantity in some campaigns: share of intervals that hold the truth, distance in sds.

    - `of`: campaigns. - `inside`: whether the share lies in the band.
    """

    of: int
    share: float
    distance: float
    inside: bool


def page(code: OneCode, origin: str) -> str:
    """Write the page.

    - origin: where the seeds are from.
    """
    left = f" {sum(code.others.values())} rows of other commits are left out." * bool(code.others)
    if not code.rows:
        return f"{HEAD}\n{origin}\n\nNo campaign has been run yet.\n"
    commands = " and ".join(dict.fromkeys(f"`{row['command']}`" for row in code.rows))
    made = f"{commands}, code of {code.commit} of {code.date[:10]}.{left}\n"
    sections = [_coverage(code.rows), _fits(code.rows), _channels(code.rows)]
    return "\n".join([HEAD, f"{origin}\n", made, *sections])


def held(fits: Sequence[Row], column: str) -> Held | None:
    """What intervals of a quantity hold in fits; None where none has it."""
    shares, squares = [], []
    for row in fits:
        factor = row["scale"] if column == "kappa q" else 1.0
        entries = list(_entries(row, column))
        if entries:
            shares.append(np.mean([e["q05"] <= factor * e["truth"] <= e["q95"] for e in entries]))
            squares.append(
                np.mean([((e["median"] - factor * e["truth"]) / e["sd"]) ** 2 for e in entries])
            )
    if not shares:
        return None
    low, high = binom.interval(BAND, len(shares), LEVEL)
    count = float(np.sum(shares))
    return Held(
        len(shares),
        count / len(shares),
        float(np.sqrt(np.mean(squares))),
        bool(low <= count <= high),
    )


def _entries(row: Row, column: str) -> Iterator[Row]:
    begins = QUANTITIES[column]
    for name, entry in row["answer"]["parameters"].items():
        if name == begins or (begins.endswith("[") and name.startswith(begins)):
            yield entry


def _by_population(rows: Sequence[Row]) -> dict[str, list[Row]]:
    ordered = sorted(rows, key=lambda row: row["case"]["number"])
    return {
        name: [row for row in ordered if row["case"]["population"] == name]
        for name in dict.fromkeys(row["case"]["population"] for row in ordered)
    }


def _coverage(rows: Sequence[Row]) -> str:
    lines, every = [], []
    for population, fits in _by_population(rows).items():
        usable = [row for row in fits if row["answer"].get("usable")]
        found = [held(usable, column) for column in QUANTITIES]
        every += [one for one in found if one is not None]
        lines.append(f"| {population} | {len(usable)} | " + " | ".join(map(_cell, found)) + " |")
    head = "| population | fits | " + " | ".join(QUANTITIES) + " |"
    outside = sum(not one.inside for one in every)
    told = (
        f"\n{outside} of {len(every)} shares lie outside their band; chance leaves one in twenty "
        "there at most.\n"
    )
    return "\n".join([COVERAGE, head, "|---" * (2 + len(QUANTITIES)) + "|", *lines, told])


def _cell(one: Held | None) -> str:
    if one is None:
        return "-"
    told = f"{100 * one.share:.0f} ({one.distance:.2f})"
    return told if one.inside else f"**{told}**"


def _fits(rows: Sequence[Row]) -> str:
    lines = [
        "## Fits\n",
        "*Gap*: least to greatest. *Release*: greatest error of a release's time [ms].\n",
        "| population | fits | usable | gap | release | failed checks | core-seconds, median |",
        "|---" * 7 + "|",
    ]
    for population, fits in _by_population(rows).items():
        good = [row for row in fits if "refused" not in row["answer"]]
        if not good:
            said = fits[0]["answer"]["refused"].splitlines()[0]
            lines.append(f"| {population} | 0 of {len(fits)} |" + " |" * 4 + f" refused: {said} |")
            continue
        answers = [row["answer"] for row in good]
        gaps = [answer["gap"] for answer in answers]
        late = [
            abs(e["median"] - e["truth"]) for row in good for e in _entries(row, "release time")
        ]
        failed = sorted({name for a in answers for name, ok, _ in a["checks"] if not ok})
        cells = [
            population,
            f"{len(good)} of {len(fits)}",
            f"{sum(a['usable'] for a in answers)}",
            f"{min(gaps):.3f}-{max(gaps):.3f}",
            f"{1e3 * max(late):.2f}" if late else "-",
            ", ".join(failed) or "none",
            f"{np.median([row['core_s'] for row in good]):.0f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _channels(rows: Sequence[Row]) -> str:
    lines = [
        "## Where residuals are largest\n",
        "The channel with the greatest gap of all fits of a population; *without*: its gap when\n"
        "its five largest residuals are left out; *largest*: size (in units of the sheet's noise)\n"
        "and time of the largest; *lag 1*: autocorrelation of residuals one step ahead.\n",
        "| population | seed | record | channel | gap | without | largest | lag 1 "
        "| strap lets go |",
        "|---" * 9 + "|",
    ]
    for population, fits in _by_population(rows).items():
        every = [
            (channel, row)
            for row in fits
            if "refused" not in row["answer"]
            for channel in row["answer"]["channels"]
        ]
        if not every:
            continue
        c, row = max(every, key=lambda one: one[0]["gap"])
        at, size = c["largest"][0]
        straps = ", ".join(f"{1e3 * s[2]:.1f} ms" for s in row["straps"] if s[2]) or "at once"
        lines.append(
            f"| {population} | {row['case']['seed']} | {c['record']} | {c['quantity']} "
            f"| {c['gap']:.2f} | {c['without_largest']:.2f} | {size:+.1f} at {at:.4f} s "
            f"| {c['lag_1']:.2f} | {straps} |"
        )
    return "\n".join(lines) + "\n"
