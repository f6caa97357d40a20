"""The sentences of the page that depend on what was found."""

from collections.abc import Sequence

from rigid.plots import metrology
from rigid.report.content import Check, KeyNumber

# Beyond this ratio of sd and median, "value ± sd" would suggest a symmetry that is not there.
_SYMMETRIC_UP_TO = 0.25


def verdict(usable: bool, checks: Sequence[Check]) -> str:
    """One sentence: may the numbers on this page be used."""
    failed = [check.name for check in checks if not check.ok]
    if usable and not failed:
        return f"Usable: {_all_checks(len(checks))}."
    if usable:
        return f"Usable, with reserve: {listed(failed)} did not pass and must be kept in mind."
    if failed:
        return f"Not usable as it stands: {listed(failed)} failed."
    return "Not usable as it stands."


def _all_checks(n: int) -> str:
    return {0: "no check was asked for", 1: "the one check passed"}.get(n, f"all {n} checks passed")


def listed(names: Sequence[str]) -> str:
    """Names as a sentence lists them: "a, b and c"."""
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} and {names[-1]}"


def main_form(number: KeyNumber) -> str:
    """Value ± sd where that is honest, else the median; its interval stands beside it."""
    if number.range:
        return number.range
    if number.sd <= _SYMMETRIC_UP_TO * abs(number.median):
        return metrology.estimate(number.median, number.sd, number.unit)
    return metrology.median((number.q05, number.median, number.q95), number.unit)


def reading(number: KeyNumber) -> str:
    """What the number says: its own sentence, or where published values lie about its interval."""
    if number.reading or not number.published:
        return number.reading
    parts = [
        f"{metrology.exact(value.value, number.unit)} ({value.place}) {_place(value.value, number)}"
        for value in number.published
    ]
    text = "; ".join(parts)
    return f"{text}."


def _place(value: float, number: KeyNumber) -> str:
    if value < number.q05:
        return "lies below the interval"
    if value > number.q95:
        return "lies above the interval"
    return "lies within the interval"
