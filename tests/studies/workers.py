"""Throughput by workers, cost by size of a campaign, and what the client does for a job.

    python tests/studies/workers.py

Each part runs jobs on workers of its own, which begin without a compiled program. `fits` are
replicates of `rigid validate` in its fast mode (a campaign drawn, searched, summed by weights, at
conditional modes or by chain), of the shipped spec with some records, all, and all twice; `slopes`
are those of `rigid validate --slopes`; `nothing` are jobs that do nothing, and `files` leave a file
as large as a report. Resumable; OUT.jsonl, OUT.md.
"""

import argparse
import datetime
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rows import carry_out, lines_of

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "fits" / "calibration.toml"
SEED = 6021
FEW = ("frame-1", "free-run-1", "release-1")
REPORT = 4 * 2**20
"""Bytes of a report with its draws and its figures, about."""
NODES, CORES, FITS, LINE = 100, 16, 10_000, 1e9 / 8
"""Of the projection: machines, cores of each, fits, and bytes a second into the client."""


class Case(NamedTuple):
    """One part: so many jobs of a sort on so many workers; `size` of the campaign."""

    number: int
    sort: str
    size: str
    workers: int
    jobs: int


CASES = (
    Case(0, "nothing", "-", 2, 2000),
    Case(1, "files", "-", 2, 300),
    Case(2, "slopes", "whole", 1, 60),
    Case(3, "slopes", "whole", 2, 60),
    Case(4, "fits", "few", 2, 6),
    Case(5, "fits", "whole", 2, 8),
    Case(6, "fits", "twice", 2, 4),
)


def nothing(given: Any) -> dict:
    """Do nothing."""
    return {}


def files(given: Any) -> dict:
    """Leave a file that cannot be compressed."""
    (given.out / "report").write_bytes(os.urandom(REPORT))
    return {}


def text_of(size: str) -> str:
    """The shipped spec with some records, all, or all twice; those of field tests left out."""
    head, *blocks = SHIPPED.read_text("utf-8").split("[[records]]\n")
    blocks = [one.strip() for one in blocks if 'kind = "field"' not in one]
    named = {one: one.split('name = "')[1].split('"')[0] for one in blocks}
    if size == "few":
        blocks = [one for one in blocks if named[one] in FEW]
    if size == "twice":
        again = {n: f'name = "{n}"' for n in named.values()}
        blocks += [one.replace(again[named[one]], f'name = "{named[one]}-again"') for one in blocks]
    return head + "".join(f"[[records]]\n{one}\n\n" for one in blocks)


def jobs_of(case: Case) -> tuple[str, list]:
    """Name of the function and its jobs."""
    from rigid.jobs.job import Job
    from rigid.spec import parse_spec
    from rigid.validation.design import FAST, SLOPES, Design, arguments

    if case.sort in ("nothing", "files"):
        return f"workers:{case.sort}", [Job(f"job-{n}", {"n": n}) for n in range(case.jobs)]
    spec = parse_spec(text_of(case.size), SHIPPED)
    design = Design(SEED, FAST if case.sort == "fits" else SLOPES)
    paths = tuple(dict.fromkeys(r.file.absolute() for r in spec.records))
    jobs = [Job(f"job-{n}", arguments(spec, design, n), paths) for n in range(case.jobs)]
    return "rigid.validation.replicate:one", jobs


def one_part(case: Case) -> dict:
    """When each job ended, and what it cost."""
    from rigid.jobs.job import contents, order
    from rigid.jobs.run import run

    function, jobs = jobs_of(case)
    os.environ["PYTHONPATH"] = str(Path(__file__).parent)
    ends, costs, by = [], [], []
    with tempfile.TemporaryDirectory() as programs:
        os.environ["RIGID_CACHE"] = programs
        spent, began = time.process_time(), time.perf_counter()
        for row in run(function, jobs, case.workers):
            if row["failed"] is not None:
                raise RuntimeError(row["failed"]["says"])
            ends.append(round(time.perf_counter() - began, 3))
            costs.append(round(row["cost"]["cpu_s"], 3))
            by.append(row["value"].get("by"))
    return {
        "case": case._asdict(),
        "client_cpu_s": round(time.process_time() - spent, 3),
        "ends_s": ends if case.sort in ("fits", "slopes") else [ends[0], ends[-1]],
        "cpu_s": costs if case.sort in ("fits", "slopes") else [sum(costs)],
        "by": by if case.sort == "fits" else None,
        "sent_bytes": len(order(function, jobs[0])),
        "record_bytes": sum(len(one) for one in contents(jobs[0]).values()),
    }


def rate(row: dict) -> float:
    """Jobs an hour of the later half, when every worker has its programs."""
    ends = row["ends_s"]
    half = len(ends) // 2
    return 3600.0 * (len(ends) - 1 - half) / (ends[-1] - ends[half])


def each(row: dict) -> float:
    """Wall time [s] of a job that does next to nothing, start of workers left out."""
    first, last = row["ends_s"]
    return (last - first) / (row["case"]["jobs"] - 1)


def page(rows: dict[int, dict]) -> str:
    """Throughput, cost, and the projection."""
    out = [
        "| jobs | campaign | workers | first end [s] | core-s of a job, median (least to most) "
        "| core-s of the first to end, which compiled | jobs an hour |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows.values():
        case = row["case"]
        if case["sort"] not in ("fits", "slopes"):
            continue
        first, *later = row["cpu_s"]
        out.append(
            f"| {case['sort']} | {case['size']} | {case['workers']} | {row['ends_s'][0]:.0f} "
            f"| {statistics.median(later):.1f} ({min(later):.1f} to {max(later):.1f}) "
            f"| {first:.0f} "
            f"| {f'{rate(row):.0f}' if case['sort'] == 'slopes' else '-'} |"
        )
    return "\n".join([*out, "", *_client(rows), *_projection(rows)])


def _client(rows: dict[int, dict]) -> list[str]:
    if not {0, 1} <= rows.keys():
        return []
    none, large = rows[0], rows[1]
    return [
        f"A job that does nothing takes {1e3 * each(none):.1f} ms from one end to the next on two "
        f"workers ({none['case']['jobs']} of them; the client's own "
        f"{1e3 * none['client_cpu_s'] / none['case']['jobs']:.1f} ms of a core); one that leaves "
        f"{REPORT / 2**20:.0f} MiB takes {1e3 * each(large):.0f} ms "
        f"({1e3 * large['client_cpu_s'] / large['case']['jobs']:.0f} ms). "
        f"A fit of the shipped spec is sent {rows[max(rows)]['sent_bytes'] / 1e3:.0f} kB, and once "
        f"a worker {rows[max(rows)]['record_bytes'] / 1e6:.1f} MB of records where it has none.",
        "",
    ]


def _projection(rows: dict[int, dict]) -> list[str]:
    if not {0, 1, 5} <= rows.keys():
        return []
    whole, workers = rows[5], NODES * CORES
    first, *later = whole["cpu_s"]
    mean, compiling = statistics.fmean(later), first - statistics.median(later)
    worked = (FITS * mean / workers + compiling) / 60.0
    longest = (max(later) + compiling) / 60.0
    client, line = FITS * each(rows[0]) / 60.0, FITS * REPORT / LINE / 60.0
    return [
        f"**On paper: {FITS:,} fits on {NODES} machines of {CORES} cores**, one worker a core. The "
        f"work, {FITS * mean / 3600.0:.0f} core-h at {mean:.0f} core-s, takes {worked:.0f} min "
        f"with the {compiling:.0f} core-s that a worker compiles for once; not less than the "
        f"longest fit, {longest:.0f} min. The client hands out and takes in all in {client:.1f} "
        f"min; reports of {REPORT / 2**20:.0f} MiB each take {line:.0f} min of a line of 1 Gbit/s, "
        f"or {FITS * each(rows[1]) / 60.0:.0f} min at the rate of this machine. "
        f"So {'the line to the client' if line > worked else 'the work'} is what it waits for.",
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--parts", type=int, nargs="*", help="numbers of parts; none: all")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "studies" / "workers")
    args = parser.parse_args()
    path = args.out.with_suffix(".jsonl")
    cases = [one for one in CASES if not args.parts or one.number in args.parts]
    says: Callable[[dict], object] = lambda row: row["cpu_s"]  # noqa: E731
    carry_out(path, cases, one_part, says)
    rows = {row["case"]["number"]: row for row in lines_of([path])}
    code = ", ".join(sorted({row["commit"] for row in rows.values()}))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    about = " ".join((__doc__ or "").split("\n\n")[2].split(" Resumable")[0].split())
    text = f"""# Workers: throughput, cost by size, and a projection

`python {" ".join(sys.argv)}`, code of {code}, {today} (simulated, seed {SEED}), two cores.

{about}

{page(dict(sorted(rows.items())))}
"""
    args.out.with_suffix(".md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
