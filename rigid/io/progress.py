"""What a run says on standard error while it works: lines, and one line for each stage."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from typing import Literal

from rigid.io.provenance import invocation

COLOURS = {"red": "31", "green": "32", "bold": "1"}
KNOWN = (
    "{desc}: {percentage:3.0f} %|{bar:20}| {n_fmt} of {total_fmt}{unit}, {elapsed}, "
    "{remaining} left{postfix}"
)
WRITE = "write the report"
"""Title of the stage that all commands end with."""
UNKNOWN = "{desc}: {n_fmt}{unit}, {elapsed}{postfix}"


class Stage:
    """A stage of a run that is to be quiet; the others say more.

    - `title`: what is done. - `total`: how many `unit` it has; None: that shows at its end.
    """

    def __init__(self, title: str, total: int | None, unit: str):
        self.title, self.total, self.unit = title, total, f" {unit}" if unit else ""
        self.done, self.says, self.began = 0, "", time.monotonic()

    def reach(self, done: int, says: str = "") -> None:
        """Show that `done` of the total are done; `says`: how things stand."""
        self.done, self.says = done, says

    def add(self, count: int) -> None:
        """Show that `count` more are done."""
        self.reach(self.done + count, self.says)

    def aside(self, line: str) -> None:
        """Write a line that does not belong to the stage."""

    def end(self, finished: bool) -> None:
        """Write what was done and how long it took, where it is `finished`."""

    def summary(self) -> str:
        """What was done, how things stood at the end, and the time it took."""
        of = "" if self.total is None or self.done > self.total else f" of {self.total}"
        asked = f" ({self.total} asked for)" if self.total is not None and not of else ""
        counted = f"{self.done}{of}{self.unit}{asked}" if self.done else ""
        took = duration(time.monotonic() - self.began)
        return ", ".join(filter(None, (counted, self.says, took)))


class Bar(Stage):
    """A stage on a terminal or in a notebook: a bar with the time left, then one line."""

    def __init__(self, title: str, total: int | None, unit: str):
        super().__init__(title, total, unit)
        from tqdm.auto import tqdm

        self.bar = tqdm(
            total=total, desc=title, unit=self.unit, leave=False,
            bar_format=UNKNOWN if total is None else KNOWN,
        )  # fmt: skip

    def reach(self, done: int, says: str = "") -> None:
        """Move the bar."""
        super().reach(done, says)
        self.bar.set_postfix_str(says, refresh=False)
        self.bar.update((done if self.total is None else min(done, self.total)) - self.bar.n)

    def aside(self, line: str) -> None:
        """Write a line above the bar."""
        self.bar.write(line, file=sys.stderr)

    def end(self, finished: bool) -> None:
        """Put a line in the place of the bar."""
        self.bar.close()
        if finished:
            _write(f"{painted(self.title, 'green')}: {self.summary()}\n")


class Line(Stage):
    """A stage in a file: one line, with a number for every tenth that is done."""

    def __init__(self, title: str, total: int | None, unit: str):
        super().__init__(title, total, unit)
        self.tenths = 0
        _write(f"{title}:")

    def reach(self, done: int, says: str = "") -> None:
        """Write the tenths that are done since."""
        super().reach(done, says)
        tenths = min(10 * done // self.total, 10) if self.total else 0
        if tenths > self.tenths:
            self.tenths = tenths
            _write(f" {10 * tenths} %")

    def aside(self, line: str) -> None:
        """Write a line, and go on below it."""
        _write(f" ...\n{line}\n{self.title}:")

    def end(self, finished: bool) -> None:
        """End the line."""
        _write(f"{',' if self.tenths else ''} {self.summary()}\n" if finished else "\n")


_OPEN: ContextVar[Stage | None] = ContextVar("open", default=None)


@contextmanager
def stage(quiet: bool, title: str, total: int | None = None, unit: str = "") -> Iterator[Stage]:
    """One stage of a run, as long as the block lasts; its time is told at the end of the run.

    - `total`: how many `unit` there are; None: that shows at the end.
    """
    watched = sys.stderr.isatty() or "ipykernel" in sys.modules
    sort = Stage if quiet else Bar if watched else Line
    shown, finished = sort(title, total, unit), False
    token = _OPEN.set(shown)
    try:
        yield shown
        finished = True
    finally:
        _OPEN.reset(token)
        shown.end(finished)
        if not quiet:
            invocation().stages.append((title, time.monotonic() - shown.began))


@contextmanager
def stages(quiet: bool) -> Iterator[Callable[[str], None]]:
    """Stages one after another; what is yielded ends the last and begins one of that title."""
    with ExitStack() as last:

        def follow(title: str) -> None:
            last.close()
            last.enter_context(stage(quiet, title))

        yield follow


def say(quiet: bool, line: str) -> None:
    """Print a line of progress to standard error, unless it is to be `quiet`."""
    if not quiet:
        shown = _OPEN.get()
        _write(f"{line}\n") if shown is None else shown.aside(line)


def times() -> Iterator[str]:
    """A line on how long each stage took, in their order; none where a run had no stages."""
    took: dict[str, float] = {}
    for title, seconds in invocation().stages:
        took[title] = took.get(title, 0.0) + seconds
    listed = ", ".join(f"{title} {duration(seconds)}" for title, seconds in took.items())
    if took:
        yield f"times: {listed}; in all {duration(invocation().wall_s)}"


def duration(seconds: float) -> str:
    """A time as text: 7.2 s, 48 s, 3 min 20 s."""
    if seconds < 60:
        return f"{seconds:.{0 if seconds >= 10 else 1}f} s"
    return f"{int(seconds) // 60} min {int(seconds) % 60} s"


def painted(text: str, colour: Literal["red", "green", "bold"]) -> str:
    """Text in a colour, where standard error is a terminal that has them and nobody said no."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    if plain or not sys.stderr.isatty():
        return text
    return f"\033[{COLOURS[colour]}m{text}\033[0m"


def _write(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()
