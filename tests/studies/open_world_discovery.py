"""The page of discovery in the open world, from its rows: by population, never a mixture."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from discovery_bars import reliability, share, table
from discovery_scores import CONFIDENT, Known, calibration_error, forecaster_band, known_from
from open_world_scores import (
    MET,
    MISSED,
    NONE,
    OPEN,
    Judged,
    added,
    judged,
    least_p,
    standing,
    stated,
    uniform,
    verdict_p,
)
from open_world_truth import CATALOGUED, COMPLETE, OUTSIDE, TWIN, Row
from rows import OneCode

Groups = Mapping[str, Sequence[Judged]]
"""Campaigns by population."""
ALARMS, ENOUGH = 0.05, 60
"""Upper bound of false alarms, and of how many campaigns of a population at least."""
WRONG = {CATALOGUED: 0.02, OUTSIDE: 0.05}
"""Share of wrong names with confidence, by sort of campaign."""
HEAD = """\
# The open world: discovery by population

Campaigns of the [second simulator](populations.md), which shares no code with the package nor with
its generator; discovery runs on each as the command does. All of it is simulated. Populations stand
apart and are never mixed. Bounds are one-sided, 95 %, after Clopper and Pearson. A run that ended
with status 1 (*failed check*), was refused or failed (*no answer*) has a column of its own and
counts as right in nothing. Shares of alarms and wrong names are of the runs that ended well and of
all alarms, whatever the checks say.
"""


class Bar(NamedTuple):
    """What is asked of a population, and where it stands to that."""

    measure: str
    bar: str
    population: str
    stands: str


def page(code: OneCode, lookalikes: Mapping, populations: Sequence[str], origin: str) -> str:
    """Write the page; without a row it says so.

    - populations: all that a whole round has; origin: where the seeds are from.
    """
    head = HEAD + f"\n{origin}\n"
    if not code.rows:
        return head + "\nNo campaign has been run yet.\n"
    known = known_from(lookalikes)
    rows = sorted(code.rows, key=lambda row: row["case"]["number"])
    every = judged(rows, known)
    groups = _by_population(every)
    commands = " and ".join(dict.fromkeys(f"`{row['command']}`" for row in rows))
    left = ", ".join(f"{count} of {name}" for name, count in sorted(code.others.items()))
    told = (
        f"\n{commands}, code of {code.commit} of {code.date[:10]}: {len(rows)} campaigns, "
        f"{_rounds(rows, populations)} whole rounds over {len(populations)} populations. "
        f"Rows of other commits, left out: {left or 'none'}.\n"
    )
    sections = [
        _summary(_bars(groups)),
        _alarms(_of(groups, COMPLETE)),
        _wrong(groups),
        _harm(groups),
        _found(_of(groups, CATALOGUED)),
        _outside(_of(groups, OUTSIDE)),
        _places(groups),
        _uniform(_of(groups, COMPLETE)),
        _calibration(every, known),
        _cost(groups),
        _misses(every),
    ]
    return "\n".join([head + told, *sections])


def _by_population(campaigns: Sequence[Judged]) -> dict[str, list[Judged]]:
    groups: dict[str, list[Judged]] = {}
    for one in campaigns:
        groups.setdefault(one.row["case"]["population"], []).append(one)
    return groups


def _of(groups: Groups, sort: str) -> Groups:
    return {name: group for name, group in groups.items() if group[0].sort == sort}


def _rounds(rows: Sequence[Row], populations: Sequence[str]) -> int:
    """How many seeds every population has been run with."""
    seeds = {name: set() for name in populations}
    for row in rows:
        seeds.setdefault(row["case"]["population"], set()).add(row["case"]["seed"])
    return len(set.intersection(*seeds.values()))


def _count(group: Sequence[Judged], true: Callable[[Judged], bool]) -> int:
    return sum(map(true, group))


def _lost(group: Sequence[Judged]) -> str:
    return f"{_count(group, lambda j: j.unusable)} | {_count(group, lambda j: j.lost)}"


def _stand(group: Sequence[Judged], true: Callable[[Judged], bool], bar: float, least=None) -> str:
    return standing(_count(group, true), len(group), bar, least)


def _heard(group: Sequence[Judged]) -> list[Judged]:
    return [one for one in group if one.heard]


def _named(group: Sequence[Judged]) -> list[Judged]:
    return [one for one in group if one.names]


def _bars(groups: Groups) -> list[Bar]:
    """Every bar of every population."""
    found = []
    for name, group in groups.items():
        sort = group[0].sort
        if sort == COMPLETE:
            stands = _stand(_heard(group), lambda j: j.falsely, ALARMS, ENOUGH)
            asked = f"upper bound {100 * ALARMS:g} %, {ENOUGH} campaigns and more"
            found.append(Bar("false alarms", asked, name, stands))
            inside = _inside(least_p(group))
            found.append(Bar("least p-values of disagreements", "uniform", name, inside))
        else:
            limit, bar = WRONG[sort], f"{100 * WRONG[sort]:g} %"
            for title, some in (("of campaigns", _heard(group)), ("of those named", _named(group))):
                stands = _stand(some, lambda j: j.misnamed, limit)
                found.append(
                    Bar(f"wrong name at {CONFIDENT:g}, {sort}, {title}", bar, name, stands)
                )
        made = added(group)
        if made.steps:
            stands = MISSED if made.wider or made.worse else MET
            found.append(Bar("additions that widen the gap or predict worse", "none", name, stands))
    return [one for one in found if one.stands != NONE]


def _inside(values: Sequence[float]) -> str:
    if not values:
        return NONE
    found = uniform(values)
    if found.distance > found.band:
        return MISSED
    return MET if found.of >= ENOUGH else OPEN


def _summary(bars: Sequence[Bar]) -> str:
    lines = []
    for measure, bar in dict.fromkeys((one.measure, one.bar) for one in bars):
        mine = [one for one in bars if (one.measure, one.bar) == (measure, bar)]
        missed = ", ".join(one.population for one in mine if one.stands == MISSED) or "none"
        counts = [sum(one.stands == stands for one in mine) for stands in (MET, OPEN)]
        lines.append(f"| {measure} | {bar} | {counts[0]} of {len(mine)} | {missed} | {counts[1]} |")
    head = "| measure | bar | met by populations | not met by | too few to say |"
    words = (
        "A bar on a share is met where its upper bound lies below the bar and not met where its "
        "lower bound lies above; false alarms fail theirs where there are enough campaigns and the "
        "upper bound lies above. Of bands of 95 %, one in twenty is left by chance.\n\n"
    )
    return "## The bars\n\n" + words + table(head, lines)


def _alarms(groups: Groups) -> str:
    lines = [
        f"| {name} | {share(_heard(group), lambda j: j.falsely)} | "
        f"{_stand(_heard(group), lambda j: j.falsely, ALARMS, ENOUGH)} | "
        f"{_count(group, lambda j: j.truly)} | "
        f"{_count(group, lambda j: bool(j.names))} | {_count(group, lambda j: j.misnamed)} | "
        f"{_count(group, lambda j: j.quiet)} | {_lost(group)} |"
        for name, group in groups.items()
    ]
    head = (
        "| nothing is hidden | false alarms | | bounds | bar | right names | with a name "
        f"| at {CONFIDENT:g} and more | quiet | failed check | no answer |"
    )
    words = (
        "An alarm: the verdict names an effect or says that something unnamed is missing. Where "
        "nothing is hidden but converters average over a tenth of an interval, the name of that is "
        "right and no false alarm.\n\n"
    )
    return "## False alarms\n\n" + words + table(head, lines)


def _wrong(groups: Groups) -> str:
    lines = []
    for sort, bar in WRONG.items():
        for name, group in _of(groups, sort).items():
            named = _named(group)
            cells = [f"{name}, {sort}", f"{100 * bar:g} %"]
            for some in (_heard(group), named):
                cells.append(share(some, lambda j: j.misnamed))
                cells.append(_stand(some, lambda j: j.misnamed, bar))
            lines.append(f"| {' | '.join(cells)} |")
    head = (
        "| hidden | bar | wrong, of campaigns | | bounds | stands "
        "| wrong, of those with a name | | bounds | stands |"
    )
    words = (
        f"A wrong name at a probability of {CONFIDENT:g} and more, in any step. The name of a "
        f"cause that leaves the same trace (cosine of {TWIN:g} and more) is not wrong.\n\n"
    )
    return "## Wrong names\n\n" + words + table(head, lines)


def _harm(groups: Groups) -> str:
    lines = []
    for name, group in groups.items():
        made = added(group)
        if made.steps:
            lines.append(f"| {name} | {made.steps} | {made.wider} | {made.worse} |")
    head = "| population | steps | widen the gap | predict left-out records worse |"
    words = "Steps that added an effect; the other populations have none.\n\n"
    return "## What additions do\n\n" + words + table(head, lines)


def _found(groups: Groups) -> str:
    lines = [
        f"| {name} | {group[0].row['nearest']} | {share(group, lambda j: j.found)} | "
        f"{share(group, lambda j: j.rightly)} | {_count(group, lambda j: j.by_twin)} | "
        f"{_count(group, lambda j: j.among)} | {_lost(group)} |"
        for name, group in groups.items()
    ]
    head = (
        "| hidden | nearest | found | | bounds | right name first | | bounds | by a twin's "
        "| named as another possibility | failed check | no answer |"
    )
    words = (
        "*By a twin's*: of the right names, those of a cause that leaves the same trace. *Named as "
        "another possibility*: the verdict is `indistinguishable`, and the right name is among the "
        "others that it gives.\n\n"
    )
    return "## Hidden, in the catalogue\n\n" + words + table(head, lines)


def _outside(groups: Groups) -> str:
    lines = [
        f"| {name} | {share(group, lambda j: j.flagged)} | {share(group, lambda j: j.rightly)} | "
        f"{_count(group, lambda j: bool(j.names))} | {_lost(group)} |"
        for name, group in groups.items()
    ]
    head = (
        "| hidden | flagged | | bounds | said first: unnamed | | bounds | with a name "
        "| failed check | no answer |"
    )
    words = (
        "Flagged: something is said to be missing, and no name is given at a probability of "
        f"{CONFIDENT:g} and more.\n\n"
    )
    return "## Outside the catalogue\n\n" + words + table(head, lines)


def _places(groups: Groups) -> str:
    lines = [
        f"| {name} | {share(group, lambda j: j.in_equation)} | "
        f"{share(group, lambda j: j.in_record)} |"
        for name, group in groups.items()
        if group[0].row["truth"]
    ]
    head = "| hidden | equation | | bounds | record | | bounds |"
    words = (
        "Of the first step, of all campaigns. A record is right if it is of a kind in which the "
        "cause shows.\n\n"
    )
    return "## Where\n\n" + words + table(head, lines)


def _uniform(groups: Groups) -> str:
    lines = []
    for name, group in groups.items():
        cells = [name]
        for values in (least_p(group), verdict_p(group)):
            if not values:
                cells.append("0 | - | - | -")
                continue
            found, low = uniform(values), sum(p <= ALARMS for p in values)
            cells.append(f"{found.of} | {low} | {found.distance:.2f} | {found.band:.2f}")
        lines.append(f"| {' | '.join(cells)} |")
    head = (
        f"| nothing is missing | disagreements | {ALARMS:g} and below | distance | band "
        f"| verdicts | {ALARMS:g} and below | distance | band |"
    )
    words = (
        "Least p-value of a campaign's disagreements, which counts all comparisons, and that on "
        "which the verdict rests. *Distance*: from the uniform law, after Kolmogorov and Smirnov; "
        "chance stays below *band* in 95 % of the cases.\n\n"
    )
    return "## P-values\n\n" + words + table(head, lines)


def _calibration(every: Sequence[Judged], known: Known) -> str:
    parts = [
        "## Calibration\n\nProbability of what is said first against how often it is right, in "
        "runs that ended well. That of a name is that of all causes which leave the same trace. "
        "The populations have nothing hidden or a cause that is strong. The probability that "
        "nothing is missing counts causes of any size, those too weak to be seen among them: so "
        "here it should be right more often than stated, and no bar is set for it.\n"
    ]
    for title, sorts, missing in (
        ("Something is missing, the catalogue complete", (COMPLETE, CATALOGUED), True),
        ("Something is missing, the catalogue incomplete", (OUTSIDE,), True),
        ("Nothing is missing", (COMPLETE, CATALOGUED, OUTSIDE), False),
    ):
        mine = [one for one in every if one.sort in sorts and one.alarmed == missing]
        probability, right = stated(mine, known)
        text = "No verdict yet."
        if len(probability):
            within = calibration_error(probability, right) <= forecaster_band(probability)
            bar = f" {'Met' if within else 'Not met'}." if missing else ""
            text = f"{reliability(probability, right)}{bar}"
        left = len(mine) - len(probability)
        parts.append(f"### {title}\n\n{text} Left out: {left} of {len(mine)} campaigns.\n")
    return "\n".join(parts)


def _cost(groups: Groups) -> str:
    lines = []
    for name, group in groups.items():
        times = [one.row["core_s"] for one in group]
        made = np.median([one.row["made_s"] for one in group])
        at = f"{np.median(times):.0f} | {np.quantile(times, 0.9):.0f} | {made:.0f}"
        lines.append(f"| {name} | {len(times)} | {at} |")
    head = "| population | campaigns | median, core-seconds | 90 % below | simulating, median, s |"
    words = (
        "CPU time of all threads, compiling included where no program was kept; beside it the time "
        "that it took to simulate a campaign.\n\n"
    )
    return "## Cost\n\n" + words + table(head, lines)


def _misses(every: Sequence[Judged]) -> str:
    lines = [_miss(one) for one in every if not one.rightly or one.misnamed or one.harmed]
    head = (
        "| population | seed | verdict | names | probability | p | gap before, after "
        "| place of the first |"
    )
    words = (
        f"{len(lines)} of {len(every)} campaigns: what is said first is not right, a wrong name is "
        f"given at {CONFIDENT:g} and more, or an addition does harm.\n\n"
    )
    return "## Not right\n\n" + words + table(head, lines)


def _miss(one: Judged) -> str:
    answer, case = one.answer, one.row["case"]
    start = f"| {case['population']} | {case['seed']} | {answer['verdict']}"
    if one.lost:
        said = answer["says"].splitlines()[0].replace("|", "/")
        return f"{start} | | | | | {said} |"
    failed = ", ".join(check["name"] for check in answer["checks"] if not check["ok"])
    steps = answer["steps"]
    names = ", ".join(str(step["effect"] or "unnamed") for step in steps) or "none"
    sure = ", ".join(_figure(step["probability"], ".2f") for step in steps) or "-"
    gaps = ", ".join(_figure(answer["gap"][when], ".3f") for when in ("initial", "final"))
    return " | ".join(
        [
            f"{start}{', failed: ' * bool(failed)}{failed}",
            names,
            sure,
            _figure(answer["p_value"], ".3f"),
            gaps,
            f"{_place(steps[0]['where']) if steps else '-'} |",
        ]
    )


def _place(where: Row) -> str:
    return ", ".join(str(where[key]) for key in ("record", "channel", "equation") if where.get(key))


def _figure(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
