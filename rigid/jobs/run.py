"""Carry out independent jobs, here or on workers, and keep a row of each."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.io.files import replacing
from rigid.io.progress import stage
from rigid.io.version import __version__
from rigid.jobs.cluster import Order, client_of, over
from rigid.jobs.job import Job, contents, order
from rigid.jobs.rows import append, begin, read_rows
from rigid.jobs.work import Done, carry_out


@dataclass(frozen=True)
class Tally:
    """How far a run is.

    - `total`, `done`, `failed`: jobs; those that were done before count as done.
    - `workers`: that take jobs at once. - `cpu_s`: CPU time of the jobs that told theirs [s].
    """

    total: int
    done: int = 0
    failed: int = 0
    workers: int = 1
    cpu_s: float = 0.0


Report = Callable[[Tally], None]


def run(
    function: Callable[..., dict] | str,
    jobs: Iterable[Job],
    workers: int | str | None = None,
    rows: Path | None = None,
    *,
    resume: bool = True,
    folder: Path | None = None,
    report: Report | None = None,
) -> Iterator[dict[str, Any]]:
    """Give the row of every job, as they end; rows of jobs that were done before come first.

    - `function`: takes a `rigid.jobs.job.Given`, returns a dict that JSON can hold. A function at
      the top of a module, or its name "module:name".
    - `workers`: processes to start on this machine, or the address of a Dask scheduler; None: the
      jobs are done in this process, in their order.
    - `rows`: file that a line is appended to for each job. This process alone writes it.
    - `resume`: leave out the jobs that have a row there and have not failed; False: begin anew.
    - `folder`: what a job leaves in its `out` is written to `folder`/its name.
    - `report`: is told after every job how far it is.

    A row has `job`, `key` (SHA-256 of function, arguments and files), `failed` (None, or `status`
    as a command's and `says`), `value` (None where it failed) and `cost` (`cpu_s`, `wall_s`).
    A job's random numbers come from its arguments, so that rows do not depend on who did it.

    Raises InputError for two jobs of one name, for arguments that JSON cannot hold and for files
    that cannot be read; EnvironmentFaultError when scheduler or workers are gone for good.
    """
    named = function if isinstance(function, str) else f"{function.__module__}:{function.__name__}"
    listed = _listed(named, jobs)
    kept = _kept(rows, {key: one.name for key, one in listed.items()}) if rows and resume else {}
    if rows is not None:
        begin(rows, keep=resume)
    tally = Tally(len(listed), done=len(kept))
    yield from kept.values()
    keys = {one.name: key for key, one in listed.items()}
    for name, done, count in _ends([o for k, o in listed.items() if k not in kept], workers):
        row = _row(name, keys[name], done)
        if folder is not None:
            _write(folder / name, done)
        if rows is not None:
            append(rows, row)
        tally = replace(
            tally,
            done=tally.done + 1,
            failed=tally.failed + (row["failed"] is not None),
            workers=count,
            cpu_s=tally.cpu_s + (row["cost"]["cpu_s"] or 0.0),
        )
        if report is not None:
            report(tally)
        yield row


def _listed(function: str, jobs: Iterable[Job]) -> dict[str, Order]:
    """What is to be ordered, by key."""
    made: dict[str, Order] = {}
    names: set[str] = set()
    for job in jobs:
        if job.name in names:
            raise InputError(f"two jobs are named '{job.name}'; give each a name of its own")
        names.add(job.name)
        text = order(function, job)
        made[hashlib.sha256(text.encode()).hexdigest()] = Order(
            job.name, text, partial(contents, job)
        )
    return made


def _kept(rows: Path, wanted: dict[str, str]) -> dict[str, dict]:
    """Rows of jobs that are done, by key."""
    found = {row["key"]: row for row in read_rows(rows)}
    return {k: found[k] for k in wanted if k in found and found[k]["failed"] is None}


def _ends(orders: list[Order], workers: int | str | None) -> Iterator[tuple[str, Done, int]]:
    """Name and outcome of each job as it ends, and the number of workers."""
    if not orders:
        return
    if workers is None:
        for one in orders:
            done = carry_out(one.text, __version__)
            if "needs" in json.loads(done.text):  # a file has changed since it was listed
                done = carry_out(one.text, __version__, one.contents())
            yield one.name, done, 1
        return
    with client_of(workers) as client:
        yield from over(client, orders)


def _row(name: str, key: str, done: Done) -> dict[str, Any]:
    found = json.loads(done.text)
    return {
        "job": name,
        "key": key,
        "failed": found.get("failed"),
        "value": found.get("value"),
        "cost": found["cost"],
    }


def _write(folder: Path, done: Done) -> None:
    for name, content in done.files.items():
        with replacing(folder / name) as temporary:
            temporary.write_bytes(content)


@contextmanager
def told(options: Options, title: str, total: int) -> Iterator[Report]:
    """A progress bar: jobs done and failed, workers and CPU time."""
    with stage(options.quiet, title, total) as shown:

        def report(tally: Tally) -> None:
            shown.reach(
                tally.done,
                f"{tally.failed} failed, {tally.workers} workers, {tally.cpu_s:.0f} CPU s",
            )

        yield report
