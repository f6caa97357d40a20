"""What a run says while it works: one line a stage, for a terminal and for a file."""

import io
from contextlib import contextmanager, redirect_stderr
from types import SimpleNamespace

import pytest

from rigid.io import progress
from rigid.io.progress import painted, say, stage, stages, times
from rigid.io.provenance import running


class Terminal(io.StringIO):
    def isatty(self):
        return True


@contextmanager
def terminal(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with redirect_stderr(Terminal()) as shown:
        yield shown


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """A clock that moves on by a second whenever somebody looks."""
    seconds = iter(range(1000))
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: float(next(seconds))))


def work(quiet=False):
    with stage(quiet, "search", 4000, "starts") as shown:
        for done in range(1, 4001):
            shown.reach(done, "best 3.2")


def test_a_file_has_one_line_a_stage_with_every_tenth(capsys):
    work()
    tenths = " ".join(f"{n} %" for n in range(10, 101, 10))
    assert capsys.readouterr().err == (f"search: {tenths}, 4000 of 4000 starts, best 3.2, 1.0 s\n")


def test_a_stage_that_ends_early_says_so_and_is_not_left_at_its_limit(capsys):
    with stage(False, "sample", 1000, "least ESS") as shown:
        shown.reach(0, "50 steps")
        shown.reach(1904, "100 steps")
    assert capsys.readouterr().err == (
        "sample: 100 %, 1904 least ESS (1000 asked for), 100 steps, 1.0 s\n"
    )


def test_a_line_between_does_not_break_that_of_the_stage(capsys):
    with stage(False, "weigh"):
        say(False, "taken from differences instead")
    assert capsys.readouterr().err.splitlines() == [
        "weigh: ...", "taken from differences instead", "weigh: 1.0 s",
    ]  # fmt: skip


def test_a_terminal_shows_the_time_left_and_then_one_line(monkeypatch):
    with terminal(monkeypatch) as shown:
        work()
    drawn = shown.getvalue().split("\r")
    assert any("left" in part and "starts" in part for part in drawn)
    assert drawn[-1] == "\033[32msearch\033[0m: 4000 of 4000 starts, best 3.2, 1.0 s\n"


def test_quiet_says_nothing_and_counts_no_time(capsys):
    with running("a test"):
        work(quiet=True)
        say(True, "a line")
        assert list(times()) == []
    assert capsys.readouterr().err == ""


def test_stages_follow_one_another_and_their_times_are_summed_up(capsys):
    with running("a test"):
        for title in ("fit", "compare", "fit"):
            with stages(False) as follow:
                follow(title)
                follow("rest")
        (line,) = times()
    assert line.startswith("times: fit 4.0 s, rest 6.0 s, compare 2.0 s; in all ")
    assert len(capsys.readouterr().err.splitlines()) == 6


def test_a_stage_that_fails_ends_its_line_without_a_time(capsys):
    with pytest.raises(KeyError), stage(False, "search", 10):
        raise KeyError
    assert capsys.readouterr().err == "search:\n"


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_colours_where_the_terminal_has_them(monkeypatch, name, value):
    with terminal(monkeypatch):
        assert painted("a", "red") == "\033[31ma\033[0m"
        monkeypatch.setenv(name, value)
        assert painted("a", "red") == "a"


def test_no_colours_in_a_file(capsys):
    assert painted("a", "red") == "a"
