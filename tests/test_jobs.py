"""Independent jobs: the same rows whoever does them, what is kept, and what dies."""

import json
import os
import signal
import threading
import time
from pathlib import Path

import job_functions
import pytest

from rigid.io.errors import EnvironmentFaultError, InputError
from rigid.jobs import cluster
from rigid.jobs.job import Job, order
from rigid.jobs.rows import read_rows
from rigid.jobs.run import Tally, run
from rigid.jobs.work import carry_out, placed

SEEDS = [Job(f"seed-{seed}", {"seed": seed}) for seed in range(6)]


def values(rows) -> dict:
    return {row["job"]: row["value"] for row in rows}


def squares(mark: Path, killer: int, count: int = 6) -> list[Job]:
    return [
        Job(f"job-{x}", {"x": x, "kills": x == killer, "mark": str(mark)}) for x in range(count)
    ]


# In this process


def test_rows_are_kept_and_finished_jobs_left_out(tmp_path: Path):
    path, seen = tmp_path / "new" / "rows.jsonl", []
    first = list(run(job_functions.noise, SEEDS[:3], rows=path))
    assert first == read_rows(path)
    assert all(row["failed"] is None and row["cost"]["cpu_s"] >= 0.0 for row in first)
    again = list(run(job_functions.noise, SEEDS, rows=path, report=seen.append))
    assert again[:3] == first
    assert [row["job"] for row in read_rows(path)] == [job.name for job in SEEDS]
    assert [tally.done for tally in seen] == [4, 5, 6]
    assert seen[-1] == Tally(6, 6, 0, 1, seen[-1].cpu_s)


def test_a_job_of_other_arguments_or_files_is_another(tmp_path: Path):
    path, file = tmp_path / "rows.jsonl", tmp_path / "a.txt"
    file.write_text("one")
    job = Job("a", {"path": str(file)}, (file,))
    assert values(run(job_functions.reads, [job], rows=path))["a"]["content"] == "one"
    file.write_text("two")
    assert values(run(job_functions.reads, [job], rows=path))["a"]["content"] == "two"
    assert len(read_rows(path)) == 2


def test_a_row_that_was_cut_short_is_done_again(tmp_path: Path):
    path = tmp_path / "rows.jsonl"
    list(run(job_functions.noise, SEEDS[:2], rows=path))
    whole = path.read_bytes()
    path.write_bytes(whole[:-20])
    rows = list(run(job_functions.noise, SEEDS[:2], rows=path))
    assert [row["job"] for row in rows] == ["seed-0", "seed-1"]
    assert values(read_rows(path)) == values(rows)
    list(run(job_functions.noise, SEEDS[:1], rows=path, resume=False))
    assert [row["job"] for row in read_rows(path)] == ["seed-0"]


def test_damaged_rows_are_told_set_aside_and_made_again(tmp_path: Path, capsys):
    path = tmp_path / "rows.jsonl"
    whole = list(run(job_functions.noise, SEEDS, rows=path))
    lines = path.read_bytes().splitlines(keepends=True)
    spoilt = lines[0].replace(b'"value": {"', b'"value": {"x', 1)  # JSON still
    assert spoilt != lines[0]
    path.write_bytes(spoilt + b"\x00" + lines[1] + b"".join(lines[2:]))
    again = list(run(job_functions.noise, SEEDS, rows=path))
    assert values(again) == values(whole) == values(read_rows(path))
    assert f"{path}: 2 damaged line(s)" in capsys.readouterr().err
    assert path.with_name("rows.jsonl.damaged").read_bytes().startswith(spoilt)


def test_failures_are_rows_and_are_tried_again(tmp_path: Path):
    path = tmp_path / "rows.jsonl"
    jobs = [Job(how, {"how": how}) for how in ("input", "defect", "nan", "none")]
    rows = {row["job"]: row for row in run(job_functions.fails, jobs, rows=path)}
    assert rows["input"]["failed"] == {"status": 2, "says": "spec.toml: k_LC is no number"}
    assert rows["defect"]["failed"]["status"] == 3
    assert "ZeroDivisionError: by zero (" in rows["defect"]["failed"]["says"]
    assert "job_functions.py:" in rows["defect"]["failed"]["says"]
    assert "JSON" in rows["nan"]["failed"]["says"]
    assert rows["none"]["failed"] is None
    list(run(job_functions.fails, jobs, rows=path))
    assert len(read_rows(path)) == 4 + 3


def test_what_the_system_refuses_is_no_defect():
    (row,) = run(job_functions.refused, [Job("one", {"file": "x.nc"})])
    says = "the system refused: [Errno 28] No space left on device: 'x.nc'"
    assert row["failed"] == {"status": 3, "says": says}


def test_what_cannot_be_a_job_is_refused(tmp_path: Path):
    for jobs, says in (
        ([Job("a"), Job("a")], "two jobs are named 'a'"),
        ([Job("a", {"x": float("nan")})], "what JSON can hold"),
        ([Job("a", {"x": Path()})], "what JSON can hold"),
        ([Job("a", files=(tmp_path / "none",))], "none: No such file"),
    ):
        with pytest.raises(InputError, match=says):
            list(run(job_functions.noise, jobs))


def test_files_are_sent_where_a_worker_has_none_of_that_content(tmp_path: Path):
    file = tmp_path / "a.txt"
    file.write_text("one")
    text = order("job_functions:reads", Job("a", {"path": str(file)}, (file,)))
    from rigid import __version__

    here = carry_out(text, __version__)
    assert json.loads(here.text)["value"] == {"content": "one", "elsewhere": False}
    assert here.files == {"more/copy.txt": b"one"}
    file.write_text("another machine's")
    assert json.loads(carry_out(text, __version__).text) == {"needs": [str(file)]}
    sent = carry_out(text, __version__, {str(file): b"one"})
    assert json.loads(sent.text)["value"] == {"content": "one", "elsewhere": True}
    with placed({}, {str(file): b"one"}) as root:
        assert root is not None
    assert not root.exists()


def test_a_worker_of_another_version_says_so():
    done = json.loads(carry_out(order("job_functions:noise", SEEDS[0]), "0.0").text)
    assert "who asks has 0.0" in done["failed"]["says"]


# On workers


def test_rows_do_not_depend_on_the_number_of_workers(tmp_path: Path):
    """A program of each job's own seed, and the solver of dense systems, to the bit."""
    here = values(run(job_functions.noise, SEEDS))
    assert {value["double"] for value in here.values()} == {"float64"}
    assert len({value["sum"] for value in here.values()}) == len(SEEDS)
    path = tmp_path / "rows.jsonl"
    assert values(run(job_functions.noise, SEEDS, 2, path)) == here
    assert values(read_rows(path)) == here


def test_a_worker_that_dies_costs_its_turn_and_no_more(tmp_path: Path):
    mark = tmp_path / "mark"
    rows = list(run(job_functions.killed_once, squares(mark, killer=2), 2))
    assert mark.exists()
    assert all(row["failed"] is None for row in rows)
    assert values(rows) == {f"job-{x}": {"square": x * x} for x in range(6)}


@pytest.mark.slow  # workers are started anew some four times
def test_a_job_that_kills_workers_is_set_aside_and_named(tmp_path: Path):
    mark = tmp_path / "mark"
    rows = {r["job"]: r for r in run(job_functions.kills_always, squares(mark, 2), 2)}
    failed = rows.pop("job-2")["failed"]
    assert failed["killed_workers"]
    assert "every worker process that took this job died" in failed["says"]
    assert {name: row["value"] for name, row in rows.items()} == {
        f"job-{x}": {"square": x * x} for x in range(6) if x != 2
    }
    deaths = mark.read_text().split()
    assert len(set(deaths)) == len(deaths) == 2 * (cluster.LIVES + 1)


@pytest.mark.slow  # waits for a worker that was killed from outside
def test_a_worker_killed_from_outside_in_the_middle_costs_nothing_that_is_done(tmp_path: Path):
    path, pids = tmp_path / "rows.jsonl", []
    jobs = [Job(f"job-{n}", {"wait": 0.5}) for n in range(10)]
    for row in run(job_functions.who, jobs, 2, path):
        pids.append(row["value"]["pid"])
        if len(pids) == 3:
            os.kill(pids[-1], signal.SIGKILL)
    assert len(pids) == 10
    assert os.getpid() not in pids
    assert len(set(pids)) >= 3  # two and the one that took the place of the killed
    assert sorted(row["job"] for row in read_rows(path)) == sorted(job.name for job in jobs)


@pytest.mark.slow  # a scheduler of its own, which goes away
def test_a_scheduler_by_its_address_and_one_that_goes_away(tmp_path: Path, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(cluster, "CONNECT_S", 3.0)
    path = tmp_path / "rows.jsonl"
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", memory_limit=0, protocol="tcp"
    ) as made:
        address = made.scheduler_address
        here = values(run(job_functions.noise, SEEDS))
        assert values(run(job_functions.noise, SEEDS, address, path)) == here
    with pytest.raises(EnvironmentFaultError, match="no Dask scheduler answers there"):
        list(run(job_functions.noise, SEEDS, address))
    assert values(run(job_functions.noise, SEEDS, address, path)) == here  # nothing left to do


@pytest.mark.slow  # workers are taken away for seconds
def test_workers_that_are_gone_for_good_end_the_run(tmp_path: Path, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(cluster, "PATIENCE_S", 3.0)
    monkeypatch.setattr(cluster, "LOOK_S", 0.5)
    jobs = [Job(f"job-{n}", {"wait": 0.5}) for n in range(8)]
    path = tmp_path / "rows.jsonl"
    with LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=":0", memory_limit=0
    ) as made:
        rows = run(job_functions.who, jobs, made.scheduler_address, path)
        next(rows)
        stop = threading.Thread(target=lambda: (time.sleep(0.2), made.scale(0)))
        stop.start()
        with pytest.raises(EnvironmentFaultError, match=r"all workers are gone.*--resume goes on"):
            list(rows)
        stop.join()
    assert 1 <= len(read_rows(path)) < len(jobs)
