"""Rows of a study, and its going on where it was stopped."""

import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest
import rows
from rows import carry_out, lines_of, no_answer, of_one_commit

from rigid.io.errors import InputError


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
    assert all(row["commit"] and row["date"] for row in lines_of([path]))


def test_rows_of_commits_are_not_mixed():
    made = [{"commit": "old", "date": "2026-01-01"}] * 2 + [{"commit": "new", "date": "2026-02-01"}]
    code = of_one_commit([*made, {"commit": "older"}])  # from before rows had a date
    assert (code.commit, code.date, code.others) == ("new", "2026-02-01", {"old": 2, "older": 1})
    assert list(code.rows) == made[2:]
    assert len(of_one_commit(made, "old").rows) == 2
    assert of_one_commit([]).commit == "no commit"


def test_what_gives_no_answer_says_why_without_a_folder(tmp_path: Path):
    said = no_answer(InputError(f"{tmp_path}/spec.toml: no record"), tmp_path)
    assert said == {"verdict": "refused", "steps": [], "says": "spec.toml: no record", "status": 2}
    said = no_answer(ValueError("a defect"), tmp_path)
    assert (said["verdict"], said["status"]) == ("failed", 3)


def test_rows_of_files_that_are_not_there_are_none(tmp_path: Path):
    assert lines_of([tmp_path / "nothing.jsonl"]) == []


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
    assert rows.committed()[:2] == "20"
    table.write_text("2\n", encoding="utf-8")
    assert rows.commit() == name
    monkeypatch.chdir(code.parent / "docs")
    code.write_text("2\n", encoding="utf-8")
    assert rows.commit() == f"{name}-dirty"
