"""What the study of friction laws is worth: counts with bounds, scores, and its page."""

import datetime
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from discovery_scores import FLOOR, TOLD_APART, lower, upper

from rigid.friction.models import NAMES, VISCOUS, WORDS

Row = Mapping
FLAT = 0.7
"""Share of the stated probabilities in the flattened answer; the rest is spread evenly."""
LEAST = 0.05
HEAD = """\
# Laws of friction

Does the comparison of friction laws ([laws.md](../laws.md)) find the law that made the records, and
know when it cannot? Campaigns are simulated by code that shares nothing with the model: a rig with
a constant viscous coefficient, and beside it one law, in another form than the catalogue's
([hidden-causes.md](../hidden-causes.md)), with seeds that no development used. Strength is what is
left of a law once all constants are refitted, their part taken as linear. Every campaign has three
frame tests, two releases and free runs of both cylinders; it is judged with three settings of their
valve, and those of some laws with one as well.
Bounds are one-sided, 95 %, after Clopper and Pearson. All of it is simulated.

`python tests/studies/laws.py --size {size}`{how}, code of {commits}, {today}:
{done} of {planned} campaigns.

Laws not reached: {missing}. Fewer than ten campaigns, examples and no more: {few}.
"""
FEW = 10
"""Campaigns of a law below which the page calls them few."""


def page(rows: Sequence[Row], lookalikes: Mapping, planned: int, size: str) -> str:
    """Write the page; a section without a campaign yet says so."""
    commits = ", ".join(sorted({row["commit"] for row in rows})) or "no commit"
    counts = {law: sum(truth_of(row) == law for row in rows) for law in NAMES}
    few = ", ".join(WORDS[law] for law, n in counts.items() if 0 < n < FEW) or "none"
    missing = ", ".join(WORDS[law] for law, n in counts.items() if n == 0) or "none"
    how = "" if any("one" in row["answers"] for row in rows) else " (`--three`)"
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    told = {"how": how, "few": few, "missing": missing, "done": len(rows), "planned": planned}
    head = HEAD.format(size=size, commits=commits, today=today, **told)
    three, one = ([r for r in rows if s in r["answers"]] for s in ("three", "one"))
    sections = [
        _bars(three, lookalikes),
        _by_law(three),
        _replicated(three),
        _single(one),
        _scatter(three),
        _rows(rows),
    ]
    return "\n".join([head, *sections])


def truth_of(row: Row) -> str:
    """Name of the law that made a campaign."""
    return row["case"]["law"]


def standing(row: Row, settings: str, law: str) -> Mapping:
    """What an answer says of a law."""
    return next(x for x in row["answers"][settings]["laws"] if x["law"] == law)


def chance(row: Row, settings: str) -> float:
    """Probability that an answer gives the law that was true."""
    return standing(row, settings, truth_of(row))["probability"]


def first(row: Row, settings: str = "three") -> bool:
    """Whether the true law is the most probable."""
    return row["answers"][settings]["first"] == truth_of(row)


def first_or_tied(row: Row, settings: str = "three") -> bool:
    """Whether the true law is first, or tied with the first."""
    return first(row, settings) or truth_of(row) in row["answers"][settings]["tied"]


def strictly_first(row: Row, settings: str = "three") -> bool:
    """Whether the true law is first and no other is tied with it."""
    return first(row, settings) and not row["answers"][settings]["tied"]


def told_apart(row: Row, lookalikes: Mapping) -> bool:
    """Whether who knew all laws could part the true one from every other in 19 of 20.

    From constant friction it stands its whole strength s away, from another law s sqrt(2 (1 - c));
    half of that is the argument. Constant friction is in every other law.
    """
    law, names = truth_of(row), lookalikes["names"]
    if law not in names:
        return False
    strength = row["strengths"]["three"]
    cosines = lookalikes["cosines"][names.index(law)]
    apart = [strength * math.sqrt(0.5 * (1.0 - c)) for n, c in zip(names, cosines, strict=True)
             if n != law]  # fmt: skip
    return min([0.5 * strength, *apart]) > TOLD_APART


def log_scores(rows: Sequence[Row], settings: str = "three") -> tuple[float, float]:
    """Mean of -log p of the true law, as stated and flattened; 0 is best."""
    p = np.maximum([chance(row, settings) for row in rows], FLOOR)
    flat = FLAT * p + (1.0 - FLAT) / len(NAMES)
    return float(-np.log(p).mean()), float(-np.log(flat).mean())


def _share(rows: Sequence[Row], true: Callable[[Row], bool]) -> str:
    count, of = sum(map(true, rows)), len(rows)
    if of == 0:
        return "0 of 0 | - | -"
    bounds = f"{100 * lower(count, of):.0f}-{100 * upper(count, of):.0f} %"
    return f"{count} of {of} | {100 * count / of:.0f} % | {bounds}"


def _bars(rows: Sequence[Row], known: Mapping) -> str:
    parted = [row for row in rows if told_apart(row, known)]
    lines = [
        "## The bars, three settings",
        "",
        "| | campaigns | | bounds | asked for |",
        "|---|---|---|---|---|",
        f"| true law first, or tied | {_share(rows, first_or_tied)} | at least 90 % |",
        f"| strictly first, where it can be told apart | {_share(parted, strictly_first)} | at "
        "least 70 % |",
        f"| its probability below 5 % | {_share(rows, lambda r: chance(r, 'three') < LEAST)} | at "
        "most 5 % |",
        f"| something is tied with the first | "
        f"{_share(rows, lambda r: bool(r['answers']['three']['tied']))} | reported |",
    ]
    if rows:
        stated, flat = log_scores(rows)
        lines += [
            "",
            f"Mean log score {stated:.3f} nats, that of the flattened answer (0.7 p + 0.3/"
            f"{len(NAMES)}) {flat:.3f}; 0 is best.",
        ]
    if not known["names"]:
        lines += ["", "Which laws leave the same trace has not been computed (`--lookalikes`)."]
    lines += [
        "",
        "A law can be told apart where half its distance to every other law, in noise, is above "
        f"{TOLD_APART:.2f} (cosines of traces in lookalikes.json).",
    ]
    return "\n".join(lines) + "\n"


def grouped(rows: Sequence[Row]) -> Iterator[tuple[str, float, list[Row]]]:
    """Law, strength and campaigns of each, in the order of NAMES."""
    groups: dict[tuple[str, float], list[Row]] = {}
    for row in rows:
        groups.setdefault((truth_of(row), row["case"]["strength"]), []).append(row)
    for law, strength in sorted(groups, key=lambda k: (NAMES.index(k[0]), k[1])):
        yield law, strength, groups[law, strength]


def _by_law(rows: Sequence[Row]) -> str:
    lines = [
        "## By law",
        "",
        "| law | strength | campaigns | first | first or tied | strictly | mean p | verdicts |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for law, strength, group in grouped(rows):
        verdicts = [row["answers"]["three"]["verdict"] for row in group]
        told = ", ".join(f"{verdicts.count(v)} {v}" for v in sorted(set(verdicts)))
        mean = float(np.mean([chance(row, "three") for row in group]))
        lines.append(
            f"| {WORDS[law]} | {strength:g} | {len(group)} | {sum(map(first, group))} | "
            f"{sum(map(first_or_tied, group))} | {sum(map(strictly_first, group))} | "
            f"{mean:.2f} | {told} |"
        )
    return "\n".join(lines) + "\n"


def _replicated(rows: Sequence[Row]) -> str:
    """What the bars come to in campaigns drawn by the parabola around the true law's fits."""
    lines = [
        "## Many campaigns by the parabola",
        "",
        "From the fit of the true law in each campaign above 200 more are drawn and judged as "
        "those that errors are calibrated by ([laws.md](../laws.md), step 5): no simulation of the "
        "rig, and the model's own form of the law. It says what noise alone does to the answer.",
        "",
        "| law | strength | drawn | first | first or tied | strictly | p < 5 % | log score | "
        "flattened |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for law, strength, group in grouped(rows):
        told = [row["answers"]["three"].get("replicates") for row in group]
        got = [one for one in told if one]
        if got:
            mean = {key: float(np.mean([one[key] for one in got])) for key in got[0]}
            shares = (mean[key] for key in ("first", "first_or_tied", "strictly", "below"))
            lines.append(
                f"| {WORDS[law]} | {strength:g} | {sum(one['campaigns'] for one in got)} | "
                + " | ".join(f"{100 * share:.0f} %" for share in shares)
                + f" | {mean['score']:.2f} | {mean['flat']:.2f} |"
            )
    return "\n".join(lines) + "\n"


def _single(rows: Sequence[Row]) -> str:
    plain = [r for r in rows if truth_of(r) == VISCOUS]
    others = [r for r in rows if truth_of(r) != VISCOUS]
    hidden = [r for r in others if 0.5 * r["strengths"]["one"] < TOLD_APART]
    seen = [r for r in others if r not in hidden]

    def cannot(row: Row) -> bool:
        return row["answers"]["one"]["verdict"] == "cannot-tell"

    lines = [
        "## One setting of the valve",
        "",
        "The law is hidden from one setting where half of what is left of it there is below "
        f"{TOLD_APART:.2f}: then the answer should be `cannot-tell`, with the true law among those "
        "named.",
        "",
        "| | campaigns | | bounds |",
        "|---|---|---|---|",
        f"| hidden: `cannot-tell` | {_share(hidden, cannot)} |",
        f"| hidden: true law first or tied | {_share(hidden, lambda r: first_or_tied(r, 'one'))} |",
        f"| still to be seen: true law first or tied | "
        f"{_share(seen, lambda r: first_or_tied(r, 'one'))} |",
        f"| constant friction: first or tied | "
        f"{_share(plain, lambda r: first_or_tied(r, 'one'))} |",
    ]
    return "\n".join(lines) + "\n"


def deviations(rows: Sequence[Row]) -> np.ndarray:
    """How far differences of predictive density lie from what campaigns of the first law give.

    In their calibrated errors; of campaigns in which the first law is the true one, and of laws
    whose difference is to be told from 0 at all.
    """
    out = [
        (law["elpd_difference"] - law["elpd_expected"]) / law["elpd_error"]
        for row in rows
        if first(row)
        for law in row["answers"]["three"]["laws"]
        if law["law"] != truth_of(row) and law["elpd_error"] > 0.0
    ]
    return np.array(out)


def _scatter(rows: Sequence[Row]) -> str:
    found = deviations(rows)
    if len(found) == 0:
        told = "No campaign yet."
    else:
        told = (
            f"In the campaigns whose first law is the true one, differences of predictive density "
            f"lie {np.sqrt(np.mean(found**2)):.2f} calibrated errors (root mean square) from what "
            "campaigns of that law make one expect; 1 where the errors are right, less where the "
            f"error under the other law is the larger. {len(found)} differences, several a "
            "campaign."
        )
    return f"## Are the calibrated errors right?\n\n{told}\n"


def _rows(rows: Sequence[Row]) -> str:
    lines = [
        "## Every campaign",
        "",
        "| seed | law | strength | one setting | three: first (p of the true law), tied | one: "
        "first (p), tied | processor s |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in sorted(rows, key=lambda r: r["seed"]):
        strengths = row.get("strengths", {})
        told = [_answer(row, settings) for settings in ("three", "one")]
        seconds = sum(a.get("processor_s", 0.0) for a in row["answers"].values())
        lines.append(
            f"| {row['seed']} | {WORDS[truth_of(row)]} | {strengths.get('three', 0.0):.1f} | "
            f"{strengths.get('one', 0.0):.1f} | {told[0]} | {told[1]} | {seconds:.0f} |"
        )
    return "\n".join(lines) + "\n"


def _answer(row: Row, settings: str) -> str:
    if settings not in row["answers"]:
        return row.get("says", "not run")
    answer = row["answers"][settings]
    tied = ", ".join(WORDS[name] for name in answer["tied"]) or "none"
    return f"{WORDS[answer['first']]} ({chance(row, settings):.2f}), {tied}; {answer['verdict']}"
