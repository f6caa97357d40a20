"""Runs that are killed and go on: a few of the study's trials, and that it would see a difference."""

from pathlib import Path

import kills
import pytest


@pytest.fixture(scope="module")
def specs(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("kills") / "specs"
    kills.write_specs(folder)
    return folder


def test_a_comparison_that_is_killed_ends_as_if_it_had_not_been(specs, tmp_path):
    """Two kills in the middle of the work, and one where the disk is full."""
    whole = kills.Whole.of("laws", specs, tmp_path / "laws")
    found = kills.trial("laws", 5, ("SIGKILL", "full", "SIGKILL"), specs, whole)
    assert found["right"], found
    assert found["met"] >= 2
    (tmp_path / "laws" / "laws.csv").write_text("law\nother\n", "utf-8")
    assert whole.differ(tmp_path / "laws") == []
    assert "laws.csv" in whole.differ(tmp_path / "specs")


def test_every_command_that_goes_on_is_tried_in_every_way():
    listed = kills.cases(len(kills.COMMANDS) * len(kills.HOWS))
    assert {(c.command, c.how) for c in listed} == {
        (command, how) for command in kills.COMMANDS for how in kills.HOWS
    }
    assert kills.without_costs([{"cost": 1, "a": {"cpu_s": 2, "b": 3}}]) == [{"a": {"b": 3}}]
