"""A trial of the study of kills, and that the study would see a difference."""

import shutil
from pathlib import Path

import kills
import pytest


@pytest.fixture(scope="module")
def specs(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("kills") / "specs"
    kills.write_specs(folder)
    return folder


@pytest.mark.slow
def test_a_comparison_that_is_killed_ends_as_if_it_had_not_been(specs, tmp_path):
    """One kill in the middle of the work, and one disk that is full."""
    whole = kills.Whole.of("laws", specs, tmp_path / "laws")
    whole = whole._replace(worked_s=0.4 * whole.worked_s)  # it compiled, what is killed need not
    found = kills.trial("laws", 5, ("SIGKILL", "full"), specs, whole)
    assert found["right"], found
    assert found["met"] >= 1  # a machine that is twice as fast by now is no fault
    other = tmp_path / "other"
    shutil.copytree(whole.out, other)
    assert whole.differ(other) == []
    path = other / "laws.json"
    path.write_text(path.read_text("utf-8").replace('"seed": 1', '"seed": 2'), "utf-8")
    assert whole.differ(other) == ["laws.json"]


def test_every_command_that_goes_on_is_tried_in_every_way():
    listed = kills.cases(len(kills.COMMANDS) * len(kills.HOWS))
    assert {(c.command, c.how) for c in listed} == {
        (command, how) for command in kills.COMMANDS for how in kills.HOWS
    }
    assert kills.without_costs([{"cost": 1, "a": {"cpu_s": 2, "b": 3}}]) == [{"a": {"b": 3}}]
