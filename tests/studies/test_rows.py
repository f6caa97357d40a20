"""Rows of a study, and its going on where it was stopped."""

import subprocess
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
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


@pytest.mark.skipif(not rows.STATM.exists(), reason="the system does not tell what a process holds")
def test_memory_between_what_is_still_held_goes_back_to_the_system():
    """Blocks too small to be mapped one by one: half a gigabyte, of which one in fifty stays."""
    size, count = 64 << 10, 8_000
    blocks = [np.ones(size, dtype=np.uint8) for _ in range(count)]
    full = rows.resident()
    kept = blocks[::50]
    del blocks
    rows.give_back()
    assert len(kept) == count // 50
    assert full - rows.resident() > 0.8 * size * count


def test_rows_that_were_written_do_not_make_the_code_another(tmp_path: Path, monkeypatch):
    def git(*words: str) -> None:
        who = ("-c", "user.name=a", "-c", "user.email=a@b")
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    code, table = tmp_path / "code.py", tmp_path / "docs" / "studies" / "a.jsonl"
    table.parent.mkdir(parents=True)
    for file in (code, table):
        file.write_text("1\n", encoding="utf-8")
    git("init")
    git("add", ".")
    git("commit", "-m", "all of it")
    monkeypatch.chdir(tmp_path)
    name = rows.commit()
    assert len(name) >= 7
    table.write_text("2\n", encoding="utf-8")
    assert rows.commit() == name
    monkeypatch.chdir(code.parent / "docs")
    code.write_text("2\n", encoding="utf-8")
    assert rows.commit() == f"{name}-dirty"
