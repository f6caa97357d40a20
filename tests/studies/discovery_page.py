"""The page of the discovery benchmark, from its rows."""

import datetime
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from discovery_bars import (
    apart,
    bars,
    baselines,
    coverage,
    flagged,
    harm,
    misnamed,
    of,
    reliability,
    rightly,
    share,
    table,
    within,
)
from discovery_cases import NAMES, STRONG
from discovery_misses import misses
from discovery_scores import (
    CONFIDENT,
    NO_ANSWER,
    NOTHING,
    UNNAMED,
    Known,
    forecasts,
    known_from,
    log_scores,
    overlap,
    placed,
    said_of,
    statement,
    true_names,
    upper,
)

Row = Mapping
STRENGTHS = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0)
HEAD = """\
# Discovery

Does discovery find what is missing, name it rightly, and keep quiet when nothing is? Campaigns are
simulated by code that shares nothing with the model, most causes in another functional form
([hidden-causes.md](../hidden-causes.md)), with seeds that no development used; strength is what is
left of a cause once all constants are refitted. Bounds are one-sided, 95 %, after Clopper and
Pearson. All of it is simulated.

`python tests/studies/discovery.py --size {size} --closure`, code of {commits}, page of {today}:
{done} of {planned} campaigns.
"""
PICTURES = {
    "measures": "Power, reliability and repair; bars are the bounds (simulated)",
    "confusion": "What was said first, over what was hidden (simulated)",
}


def page(
    rows: Sequence[Row], lookalikes: Mapping, planned: int, size: str, pictures: Sequence[str] = ()
) -> str:
    """Write the page; a section without a campaign yet says so.

    - `pictures`: paths of the figures that there are, as the page links them.
    """
    known = known_from(lookalikes)
    commits = ", ".join(sorted({row["commit"] for row in rows})) or "no commit"
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    told = {"commits": commits, "today": today, "done": len(rows), "planned": planned}
    head = HEAD.format(size=size, **told)
    good = answered(rows)
    sections = [
        bars(good, known, NAMES),
        *(f"![{PICTURES[Path(path).stem]}]({path})\n" for path in pictures),
        _alarms(good),
        _power(good),
        _places(good),
        _names(good, known),
        _open(good, known),
        misses(good, known, NAMES),
        _pairs(good),
        _behind(good),
        _confidence(good),
        _confusion(good),
        _closure(good),
        coverage(good),
        harm(good),
        baselines(good),
        _cost(rows),
    ]
    return "\n".join([head, *sections])


def answered(rows: Sequence[Row]) -> list[Row]:
    """Campaigns that could be made and were not refused."""
    return [row for row in rows if row["answer"]["verdict"] not in NO_ANSWER]


def _alarms(rows: Sequence[Row]) -> str:
    groups = {"clean": of(rows, "clean"), "hard, all": of(rows, "hard")}
    for row in groups["hard, all"]:
        groups.setdefault(row["case"]["condition"], []).append(row)

    def line(name: str, group: Sequence[Row]) -> str:
        alarms = [row for row in group if row["answer"]["verdict"] != "nothing-missing"]
        named = sum(statement(row["answer"]) != UNNAMED for row in alarms)
        bound = f"{100 * upper(len(alarms), len(group)):.1f} %" if group else "-"
        return f"| {name} | {len(group)} | {len(alarms)} | {named} | {bound} |"

    return "## False alarms\n\n" + table(
        "| nothing is missing | campaigns | alarms | with a name | upper bound |",
        [line(name, group) for name, group in groups.items()],
    )


def _power(rows: Sequence[Row]) -> str:
    singles = of(rows, "single")
    lines = []
    for strength in STRENGTHS:
        group = [row for row in singles if row["case"]["strength"] == strength]
        found = share(group, lambda row: row["answer"]["verdict"] != "nothing-missing")
        named = share(group, rightly)
        lines.append(f"| {strength:g} | {found} | {named} |")
    head = "| strength | found | | bounds | right name first | | bounds |"
    return "## Power\n\nSingle effects of the catalogue.\n\n" + table(head, lines)


def _places(rows: Sequence[Row]) -> str:
    strong = [row for row in of(rows, "single") if row["case"]["strength"] >= 5.0]
    windows = [part for row in strong if (part := overlap(row)) is not None]
    lines = [
        f"| equation | {share(strong, lambda row: placed(row)[0])} |",
        f"| record | {share(strong, lambda row: placed(row)[1])} |",
        f"| both | {share(strong, lambda row: all(placed(row)))} |",
    ]
    text = table("| right at once | strength 5 and more | | bounds |", lines)
    if windows:
        middle = np.median(windows)
        text += f"\nStretch of time of a valve event: median overlap {middle:.2f} of the union, "
        text += f"{len(windows)} campaigns.\n"
    return "## Where\n\n" + text


def _names(rows: Sequence[Row], known: Known) -> str:
    strong = [row for row in of(rows, "single") if row["case"]["strength"] >= 5.0]
    told = [row for row in strong if apart(row, known, NAMES)]
    alike = [row for row in strong if not apart(row, known, NAMES)]
    aliased = of(rows, "aliased")
    lines = [
        f"| can be told apart: right name first | {share(told, rightly)} |",
        f"| cannot: `indistinguishable`, the true one among them | {share(alike, within)} |",
        f"| cannot: the same, or the right name alone | {share(alike, _named_or_within)} |",
        "| aliased records: `indistinguishable`, the true one among them | "
        f"{share(aliased, within)} |",
        f"| aliased records: the same, or the right name alone | "
        f"{share(aliased, _named_or_within)} |",
        f"| uneven records: the same, or the right name first | "
        f"{share(of(rows, 'uneven'), _named_or_within)} |",
    ]
    return (
        "## Names\n\nTwo causes can be told apart where s sqrt((1 - c)/2) is 1.64 or more, c the "
        "cosine of their traces in whole campaigns (lookalikes.json). Strength 5 and more.\n\n"
        + table("| | campaigns | | bounds |", lines)
    )


def _named_or_within(row: Row) -> bool:
    return rightly(row) or within(row)


def _open(rows: Sequence[Row], known: Known) -> str:
    strong = [row for row in of(rows, "taken out", "outside") if row["case"]["strength"] >= 5.0]
    lines = []
    for title, group in (
        ("no lookalike inside", [row for row in strong if apart(row, known, NAMES)]),
        ("a lookalike inside", [row for row in strong if not apart(row, known, NAMES)]),
    ):
        lines += [
            f"| {title}: flagged | {share(group, flagged)} |",
            f"| {title}: verdict `unnamed` | "
            f"{share(group, lambda row: statement(row['answer']) == UNNAMED)} |",
            f"| {title}: a wrong name at p of 0.9 and more | "
            f"{share(group, lambda row: misnamed(row, CONFIDENT))} |",
        ]
    return "## Outside the catalogue\n\nStrength 5 and more.\n\n" + table(
        "| | campaigns | | bounds |", lines
    )


def _pairs(rows: Sequence[Row]) -> str:
    pairs = of(rows, "pair")

    def said(row: Row) -> set[str]:
        return set(said_of(row))

    lines = [
        f"| at least one of the two | {share(pairs, lambda r: bool(said(r) & true_names(r)))} |",
        f"| both | {share(pairs, lambda r: said(r) >= true_names(r))} |",
        f"| both and nothing else | {share(pairs, lambda r: said(r) == true_names(r))} |",
    ]
    return "## Pairs\n\n" + table("| named | campaigns | | bounds |", lines)


def _behind(rows: Sequence[Row]) -> str:
    """An effect, and a cause without an entry that is as strong or stronger."""
    both = of(rows, "behind")

    def named(row: Row) -> bool:
        return row["case"]["hide"][1] in said_of(row)

    def wrong(row: Row) -> bool:
        sure = {name for name, chance in said_of(row).items() if chance >= CONFIDENT}
        return bool(sure - {row["case"]["hide"][1]})

    def first(row: Row) -> bool:
        return statement(row["answer"]) == UNNAMED

    lines = [
        f"| the effect is added | {share(both, named)} |",
        f"| the same where `unnamed` came first | {share(list(filter(first, both)), named)} |",
        f"| another at 0.9 and more | {share(both, wrong)} |",
    ]
    return (
        "## Behind an unlisted cause\n\nAn effect of the catalogue and a cause that has no entry, "
        f"at strength {STRONG:g} each.\n\n" + table("| | campaigns | | bounds |", lines)
    )


def _confidence(rows: Sequence[Row]) -> str:
    probability, right = forecasts(rows)
    if not len(probability):
        return "## Confidence\n\nNo verdict has a probability yet.\n"
    scores = log_scores(rows)
    return (
        "## Confidence\n\n" + reliability(probability, right) + f" Log score {scores.mean():.3f} "
        f"nats (the mean of -log p of what was true; 0 is best), {len(scores)} verdicts.\n"
    )


def _confusion(rows: Sequence[Row]) -> str:
    counts: dict[str, Counter] = {}
    for row in rows:
        case = row["case"]
        if case["population"] in {"pair", "aliased", "uneven", "behind"}:
            continue
        truth = case["condition"] or " + ".join(case["hide"]) or NOTHING
        if case["population"] == "taken out":
            truth += " (taken out)"
        counts.setdefault(truth, Counter())[statement(row["answer"])] += 1
    lines = [
        f"| {truth} | {said.total()} | "
        + ", ".join(f"{n} {w}" for w, n in said.most_common())
        + " |"
        for truth, said in counts.items()
    ]
    return "## What was said of what\n\n" + table("| truth | campaigns | said first |", lines)


def _closure(rows: Sequence[Row]) -> str:
    found = [row["closure"] for row in rows if row.get("closure")]
    if not found:
        return (
            "## Repair\n\nNot computed in this run (`--closure`): the part of the excess misfit to "
            "the noiseless signal that closes on left-out blocks.\n"
        )
    lines = []
    for key, title in (("named", "effect that was named"), ("placebo", "placebo")):
        values = [one[key] for one in found if one[key] is not None]
        if values:
            low, middle, high = np.quantile(values, (0.25, 0.5, 0.75))
            lines.append(f"| {title} | {len(values)} | {middle:.2f} | {low:.2f}-{high:.2f} |")
    return (
        "## Repair\n\nPart of the excess misfit to the noiseless signal that closes on left-out "
        "blocks, strength 8 and more; 1 is all of it.\n\n"
        + table("| added | campaigns | median | quartiles |", lines)
    )


def _cost(rows: Sequence[Row]) -> str:
    times = {
        "discovery": [row["discover_s"] for row in rows if "discover_s" in row],
        "discovery, core-seconds": [row["core_s"] for row in rows if "core_s" in row],
        "making the campaign": [row["made_s"] for row in rows if "made_s" in row],
    }
    lines = [
        f"| {name} | {len(t)} | {np.median(t):.0f} | {np.quantile(t, 0.9):.0f} |"
        for name, t in times.items()
        if t
    ]
    lost = Counter(row["answer"]["verdict"] for row in rows)
    return (
        "## Cost\n\n"
        + table("| time | campaigns | median, s | 90 % below, s |", lines)
        + "\nNot counted above: "
        + ", ".join(f"{lost[name]} {name}" for name in NO_ANSWER)
        + ".\n"
    )
