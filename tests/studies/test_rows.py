"""Rows of a study, and its going on where it was stopped."""

from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import pytest
import rows
from rows import carry_out, lines_of


class Case(NamedTuple):
    """A campaign of a study."""

    number: int
    law: str = "none"


def test_a_stopped_study_goes_on_with_what_has_no_row(tmp_path: Path):
    path, seen = tmp_path / "out" / "study-small.0.jsonl", []

    def one(case: Case) -> dict:
        seen.append(case.number)
        if case.number == 7 and seen.count(7) == 1:
            raise KeyboardInterrupt
        return {"case": case._asdict(), "answer": 2 * case.number}

    cases = [Case(3), Case(7), Case(5)]
    with pytest.raises(KeyboardInterrupt):
        carry_out(path, cases, one, lambda row: row["answer"])
    carry_out(path, cases, one, lambda row: row["answer"])
    assert seen == [3, 7, 7, 5]
    assert [row["answer"] for row in lines_of([path])] == [6, 14, 10]
    assert all(row["commit"] for row in lines_of([path]))


def test_rows_of_files_that_are_not_there_are_none(tmp_path: Path):
    assert lines_of([tmp_path / "nothing.jsonl"]) == []


@pytest.mark.skipif(not rows.MAPS.exists(), reason="no list of mapped memory on this system")
@pytest.mark.parametrize("bound", ["MOST_MAPS", "MOST_MEMORY"])
def test_compiled_programs_are_let_go_where_they_fill_their_room(monkeypatch, bound: str):
    program = jax.jit(lambda x: jnp.cumsum(x))
    for size in range(3, 20):
        program(jnp.ones(size))
    held = rows.resident()
    assert held > 1 << 20
    assert not rows.shed(held)
    assert program._cache_size() == 17
    monkeypatch.setattr(rows, bound, -(1 << 40))  # memory may also have shrunk since
    assert rows.shed(held)
    assert program._cache_size() == 0
