"""Sections of the benchmark's page beside the answers: the bars, baselines, coverage, harm."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from discovery_scores import (
    BINS,
    CONFIDENT,
    NOTHING,
    UNNAMED,
    Known,
    calibration_error,
    forecaster_band,
    forecasts,
    lookalike_odds,
    lower,
    parted,
    placed,
    stated,
    statement,
    true_names,
    upper,
)

Row = Mapping
One = TypeVar("One")
STRONG = 5.0
ALPHA = 0.01
LEVELS = (0.05, 0.95)


def of(rows: Iterable[Row], *populations: str) -> list[Row]:
    """Campaigns of some populations."""
    return [row for row in rows if row["case"]["population"] in populations]


def share(rows: Sequence[One], true: Callable[[One], bool]) -> str:
    """Count, share and both bounds of those rows for which something holds."""
    count, total = sum(map(true, rows)), len(rows)
    return _counted(count, total)


def _counted(count: int, total: int) -> str:
    if total == 0:
        return "0 of 0 | - | -"
    bounds = f"{100 * lower(count, total):.1f}-{100 * upper(count, total):.1f} %"
    return f"{count} of {total} | {100 * count / total:.1f} % | {bounds}"


def table(head: str, lines: Iterable[str]) -> str:
    """A table of Markdown."""
    columns = head.count("|") - 1
    return "\n".join([head, "|" + "---|" * columns, *lines]) + "\n"


def alarm(row: Row) -> bool:
    """Whether something is said to be missing."""
    return row["answer"]["verdict"] != "nothing-missing"


def flagged(row: Row) -> bool:
    """Whether something is said to be missing, and no wrong name is given with confidence."""
    return alarm(row) and not misnamed(row, CONFIDENT)


def apart(row: Row, known: Known, names: Sequence[str]) -> bool:
    """Whether an oracle could part the hidden effect from all that the catalogue holds."""
    case = row["case"]
    among = [n for n in names if n not in case["without"] and n in known.names]
    return parted(known, case["hide"][0], case["strength"], among)


def rightly(row: Row) -> bool:
    """Whether what is said first is right."""
    return statement(row["answer"]) in true_names(row)


def within(row: Row) -> bool:
    """Whether the verdict is `indistinguishable` with the true effect among those it names."""
    answer = row["answer"]
    return answer["verdict"] == "indistinguishable" and bool(true_names(row) & set(stated(answer)))


def misnamed(row: Row, confident: float) -> bool:
    """Whether a wrong name is given with confidence."""
    said = statement(row["answer"])
    wrong = said not in {NOTHING, UNNAMED} and said not in row["case"]["hide"]
    return wrong and stated(row["answer"]).get(said, 1.0) >= confident


def reliability(probability: np.ndarray, right: np.ndarray) -> str:
    """Share right over stated probability, its error, and that of a perfect forecaster."""
    place = np.minimum((probability * BINS).astype(int), BINS - 1)
    lines = [
        f"| {i / BINS:.1f}-{(i + 1) / BINS:.1f} | {np.sum(place == i)} | "
        f"{probability[place == i].mean():.3f} | {right[place == i].mean():.3f} |"
        for i in range(BINS)
        if np.any(place == i)
    ]
    return (
        table("| stated | verdicts | mean stated | share right |", lines)
        + f"\nExpected calibration error {calibration_error(probability, right):.3f} on "
        f"{len(probability)} verdicts; a perfect forecaster stays below "
        f"{forecaster_band(probability):.3f} in 95 % of the cases."
    )


class Counted(NamedTuple):
    """A bar that counts campaigns: among which, and what holds in those that count."""

    title: str
    bar: str
    rows: Sequence[Row]
    counts: Callable[[Row], bool]
    good: bool = True
    """Whether counting is what is wanted of a campaign."""


def counted(rows: Sequence[Row], known: Known, names: Sequence[str]) -> list[Counted]:
    """Every bar that is a share of campaigns."""
    singles = [r for r in of(rows, "single") if r["case"]["strength"] >= STRONG]
    told = [r for r in singles if apart(r, known, names)]
    alike = [r for r in singles if not apart(r, known, names)]
    out = [r for r in of(rows, "taken out", "outside") if r["case"]["strength"] >= STRONG]
    out = [r for r in out if apart(r, known, names)]
    bound = "upper bound 5 %"
    return [
        Counted("false alarms, clean nulls", bound, of(rows, "clean"), alarm, good=False),
        Counted("false alarms, hard nulls", bound, of(rows, "hard"), alarm, good=False),
        Counted(
            "right record and equation, strength 5 and more",
            "95 %",
            singles,
            lambda r: all(placed(r)),
        ),
        Counted("right name first where it can be told apart", "90 %", told, rightly),
        Counted("`indistinguishable` with the true one where it cannot", "90 %", alike, within),
        Counted("outside the catalogue, no lookalike: flagged", "80 %", out, flagged),
        Counted(
            "outside, no lookalike: confidently misnamed",
            "at most 5 %",
            out,
            lambda r: misnamed(r, CONFIDENT),
            good=False,
        ),
    ]


def bars(rows: Sequence[Row], known: Known, names: Sequence[str]) -> str:
    """Every bar that was set before the run, with what was found."""
    probability, right = forecasts(rows)
    error = "-"
    if len(probability):
        error = (
            f"{calibration_error(probability, right):.3f} on {len(probability)} verdicts | "
            f"band {forecaster_band(probability):.3f}"
        )
    lines = [
        *(
            f"| {c.title} | {c.bar} | {share(c.rows, c.counts)} |"
            for c in counted(rows, known, names)
        ),
        f"| expected calibration error | 0.05, or in the band, on 500 | {error} | |",
        _odds_bar(rows, known),
        _coverage_bar(rows),
    ]
    head = "| measure | bar | found | | bounds |"
    return "## The bars\n\n" + table(head, [*lines, *_closure_bars(rows), *_cost_bar(rows)])


def _odds_bar(rows: Sequence[Row], known: Known) -> str:
    odds = lookalike_odds(of(rows, "single"), known)
    title = "| odds between lookalikes, log score in nats | in the band of a perfect forecaster |"
    if odds is None:
        return f"{title} 0 campaigns | - | |"
    low, high = odds.band
    found = f"{odds.campaigns} campaigns, {odds.pairs} pairs | {odds.score:.2f}"
    return f"{title} {found} | {low:.2f}-{high:.2f} |"


def _closure_bars(rows: Sequence[Row]) -> list[str]:
    out = []
    for key, title, bar in (
        ("named", "excess misfit closed on left-out blocks, strength 8 and more, median", "90 %"),
        ("placebo", "the same by a placebo", "at most 10 %"),
    ):
        values = [r["closure"][key] for r in rows if r.get("closure")]
        values = [v for v in values if v is not None]
        text = f"{len(values)} campaigns | {100 * np.median(values):.0f} %" if values else "0 | -"
        out.append(f"| {title} | {bar} | {text} | |")
    return out


def _cost_bar(rows: Sequence[Row]) -> list[str]:
    cost = [r["core_s"] for r in rows if "core_s" in r]
    if not cost:
        return ["| core-seconds a campaign | 60 | 0 | - | |"]
    return [
        f"| core-seconds a campaign, median | 60 | {len(cost)} campaigns | {np.median(cost):.0f} s "
        f"| 90 % below {np.quantile(cost, 0.9):.0f} s |"
    ]


def _ranks(rows: Sequence[Row], when: str) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for row in rows:
        for label, rank in row.get("beside", {}).get(when, {}).items():
            found.setdefault(label.split("[")[0], []).append(rank)
    return found


def _inside(ranks: Sequence[float]) -> int:
    return sum(LEVELS[0] <= rank <= LEVELS[1] for rank in ranks)


def complete(row: Row) -> bool:
    """Whether the last fit has all that acts in the campaign: no cause stays hidden in it."""
    return set(row["case"]["hide"]) <= {step.get("effect") for step in row["answer"]["steps"]}


def _coverage_bar(rows: Sequence[Row]) -> str:
    whole = [row for row in rows if "beside" in row and complete(row)]
    ranks = [rank for found in _ranks(whole, "rank_after").values() for rank in found]
    held = _counted(_inside(ranks), len(ranks))
    return (
        "| 90 % intervals of all numbers where no cause stays hidden | 86-94 %, on 400 campaigns "
        f"(here {len(whole)}) | {held} |"
    )


def coverage(rows: Sequence[Row]) -> str:
    """How often 90 % intervals hold the truth, without and with what was added."""
    good = [r for r in rows if "beside" in r]
    whole, rest = (
        _ranks([r for r in good if complete(r) == last], "rank_after") for last in (True, False)
    )
    before = _ranks([r for r in good if not complete(r)], "rank_before")
    lines = [
        f"| {label} | {_counted(_inside(whole.get(label, [])), len(whole.get(label, [])))} | "
        + " | ".join(_part(found.get(label, [])) for found in (rest, before))
        + " |"
        for label in dict.fromkeys([*whole, *rest])
    ]
    return (
        "## Coverage\n\nHow often the 90 % interval of the Gaussian law around the last fit holds "
        "the truth: where that fit has all that acts (nothing is hidden, or all of it was named), "
        "and where a cause stays hidden in it, there beside the model as specified. What was added "
        "counts where the generator has the same number. Intervals of several records of one "
        "campaign are not independent, so that the bounds are too narrow.\n\n"
        + table(
            "| number | no cause stays hidden | | bounds | a cause does | the same, as specified |",
            lines,
        )
    )


def _part(ranks: Sequence[float]) -> str:
    return f"{_inside(ranks)} of {len(ranks)}" if ranks else "-"


def baselines(rows: Sequence[Row]) -> str:
    """What two usual ways would have said of the same fits."""
    good = [r for r in rows if "beside" in r]
    nulls, hidden = of(good, "clean", "hard"), [r for r in of(good, "single")]
    strong = [r for r in hidden if r["case"]["strength"] >= STRONG]

    def line(name: str, alarmed: Callable[[Row], bool], named: Callable[[Row], bool] | None) -> str:
        right = share(strong, named) if named else "no names | - | -"
        return f"| {name} | {share(nulls, alarmed)} | {share(strong, alarmed)} | {right} |"

    lines = [
        line("discovery", alarm, rightly),
        line("whiteness and cross-correlation", lambda r: r["beside"]["whiteness"] < ALPHA, None),
        line(
            "BIC over the catalogue",
            lambda r: r["beside"]["bic"] is not None,
            lambda r: r["beside"]["bic"] in true_names(r),
        ),
    ]
    head = (
        "| | false alarms, clean and hard | | bounds | found, strength 5 and more | | bounds "
        "| right name first | | bounds |"
    )
    return "## Baselines\n\nOn the same fits, no record left out.\n\n" + table(head, lines)


def harm(rows: Sequence[Row]) -> str:
    """What discovery moved where nothing was missing."""
    nulls = [r for r in of(rows, "clean", "hard") if "beside" in r]
    moved = [max(abs(v) for v in r["beside"]["moved"].values()) for r in nulls if _added(r)]
    words = (
        f"; where something was, the number that moved most moved by {np.median(moved):.1f} "
        f"standard deviations at the median, {max(moved):.1f} at most"
        if moved
        else ""
    )
    return (
        f"## Harm\n\nIn {len(nulls) - len(moved)} of {len(nulls)} campaigns in which nothing is "
        f"missing nothing was added, so that every quoted number stayed what it was{words}.\n"
    )


def _added(row: Row) -> bool:
    return any(step.get("effect") for step in row["answer"]["steps"])
