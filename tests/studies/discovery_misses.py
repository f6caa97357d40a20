"""Section of the benchmark's page: which campaigns keep a figure from its bar."""

from collections.abc import Sequence

from discovery_bars import Counted, Row, counted, misnamed, table
from discovery_scores import CONFIDENT, NOTHING, UNNAMED, Known, statement


def misses(rows: Sequence[Row], known: Known, names: Sequence[str]) -> str:
    """What was hidden and what was said of it, of all that does not count for its bar."""
    wanted = [one for one in counted(rows, known, names) if one.good]
    sections = [section for one in wanted if (section := _misses_of(one))]
    return "## What the bars miss\n\n" + "\n".join(sections or ["Nothing.\n"])


def _misses_of(one: Counted) -> str:
    found: dict[tuple[str, str], list[float]] = {}
    for row in one.rows:
        if not one.counts(row):
            case = row["case"]
            key = " + ".join(case["hide"]), _said(row)
            found.setdefault(key, []).append(case["strength"])
    lines = [
        f"| {hidden} | {said} | {', '.join(f'{s:g}' for s in sorted(strengths))} |"
        for (hidden, said), strengths in sorted(found.items(), key=lambda item: -len(item[1]))
    ]
    missed = sum(map(len, found.values()))
    head = f"{one.title[0].upper()}{one.title[1:]}: {missed} of {len(one.rows)} do not count.\n\n"
    return head + table("| hidden | said | at strengths |", lines) if lines else ""


def _said(row: Row) -> str:
    first, verdict = statement(row["answer"]), row["answer"]["verdict"]
    if first in {NOTHING, UNNAMED}:
        return first
    if verdict == "indistinguishable":
        return f"{first}, or another"
    return f"{first}, at p of {CONFIDENT:g} and more" if misnamed(row, CONFIDENT) else first
