"""What is booked adds up, and what a core needs for it at least."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from limits import Core, Ledger, Work, simulated


def test_memory_may_be_busy_beside_arithmetic():
    core = Core(operations=10.0, exponentials=2.0, bytes=4.0)
    assert core.least(Work(20.0, 2.0, 4.0)) == pytest.approx(3.0)
    assert core.least(Work(20.0, 2.0, 40.0)) == pytest.approx(10.0)


def test_a_reading_is_a_row_times_a_state_and_so_is_each_slope():
    assert simulated(100.0, states=7, slopes=2) == Work(100 * 3 * 2 * 7, 0.0, 100 * 3 * 8)


def test_every_lane_of_a_turn_is_booked_with_its_states():
    ledger = Ledger()

    def run(grid: Any, inputs: tuple) -> Mapping[str, np.ndarray]:
        return {"load": np.zeros((50, 3, 16)), "stroke": np.zeros((50, 3, 16))}

    turn = ledger.lanes(0)(run)
    for _ in range(2):
        turn(None, (SimpleNamespace(scales=range(8)),))
    assert ledger.runs == {"lanes": 32.0}
    assert ledger.work == simulated(300.0, states=8).times(32.0)


def test_a_step_of_a_search_is_an_expansion(monkeypatch: pytest.MonkeyPatch):
    ledger = Ledger()
    monkeypatch.setattr("limits.expanded", lambda asked: Work(asked))
    run = Mock(return_value=(None, None, 4))
    ledger.led(run)((7.0,), None)
    assert (ledger.work.operations, ledger.runs) == (5 * 7.0, {"expansions": 5.0})
