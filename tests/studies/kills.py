"""Does a run that is killed at any moment go on with --resume, and end as if nothing had happened?

    python tests/studies/kills.py --trials 36
    python tests/studies/kills.py --table

A trial runs a command on a small simulated spec in a folder of its own, ends it KILLS times at
random moments of its work (SIGKILL, SIGTERM, or a file system that takes no more), starts it again
with --resume, and compares all that it has written with an uninterrupted run: draws bit for bit,
tables and JSON letter for letter, times and costs left out. Writes a line for each trial to
OUT/kills.jsonl and the page to OUT.md. Resumable: a trial that has its line is not run again.
"""

import argparse
import datetime
import functools
import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rows import carry_out, lines_of

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where the small specs lie

KILLS = 4
"""Ends of a trial before it may finish."""
COMMANDS = ("fit", "laws", "bands", "discover", "batch", "validate")
HOWS = ("SIGKILL", "SIGKILL", "SIGKILL", "SIGTERM", "full")
"""How the first end of a trial comes, in turn; all further ones are SIGKILL."""
TOLD = {"SIGKILL": -9, "SIGTERM": 143, "full": 3}
"""Exit status of each."""
COSTS = ("cost", "cpu_s", "wall_s")
"""Keys of JSON that tell times."""
LONGEST = 3600
LOST = "Interrupted:"
"""What Python says of a signal that it ignored."""
PLACE = re.escape(tempfile.gettempdir()) + r"/[^/\s:]+"
"""Folders that a trial makes for itself."""
LIMITED = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
os.execv(sys.argv[2], sys.argv[2:])
"""
"""Runs a command whose files may not grow beyond so many bytes, without a fork of this process."""
SAMPLER = """
[sampler]
ensembles = 2
starts = 4
walkers = 16
block = 10
ess = 100.0
r_hat = 1.1
"""


class Case(NamedTuple):
    """A trial; its number is the seed of its moments."""

    number: int
    command: str
    how: str


class Ended(NamedTuple):
    """How a run ended: exit status, seconds of work, its last line; `held`: files it had kept."""

    status: int
    worked_s: float
    says: str
    held: int


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trials", type=int, default=36)
    parser.add_argument("--table", action="store_true", help="write the page, run nothing")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/kills"))
    return parser.parse_args()


def cases(trials: int) -> list[Case]:
    """Command after command; how a trial is ended goes through HOWS for each of them."""
    return [
        Case(n, COMMANDS[n % len(COMMANDS)], HOWS[n // len(COMMANDS) % len(HOWS)])
        for n in range(trials)
    ]


def write_specs(folder: Path) -> None:
    """A cart, a folder of two carts, and a field test with its posterior; all simulated."""
    from cart import write_cart
    from test_bands import spec_text, write_posterior, write_record

    (folder / "batch").mkdir(parents=True)
    for path in (
        write_cart(folder, seconds=4.0),
        write_cart(folder / "batch", "first", seconds=4.0),
        write_cart(folder / "batch", "second", drag=150.0, seed=2, seconds=4.0),
    ):
        text = path.read_text("utf-8").partition("\n[sampler]")[0]
        path.write_text(text + SAMPLER, "utf-8")
    write_record(folder / "press.csv", 45.0)  # two stretches of the way back
    write_posterior(folder / "posterior.nc")
    posterior = '[bands]\nposterior = "posterior.nc"\ndraws = 8\n'
    (folder / "field.toml").write_text(spec_text(posterior=posterior), "utf-8")


def line_of(command: str, specs: Path, out: Path) -> list[str]:
    """The command on its spec."""
    spec = {"bands": "field.toml", "batch": "batch"}.get(command, "cart.toml")
    more = ["--replicates", "6"] if command == "validate" else []
    line = [sys.executable, "-m", f"rigid.{command}", str(specs / spec), "--out", str(out)]
    return [*line, "--quiet", *more]


def ended(line: list[str], out: Path, after_s: float | None = None, how: str = "") -> Ended:
    """Run a command, and end it so long after its work has begun; None: let it finish.

    - `how`: a signal, or "full": no file may grow beyond `after_s` bytes.
    """
    full = how == "full"
    if full:
        line = [sys.executable, "-c", LIMITED, str(int(after_s or 0)), *line]
    (out / ".lock").unlink(missing_ok=True)
    with tempfile.TemporaryFile() as words:
        process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=words)
        while not (out / ".lock").exists() and process.poll() is None:
            time.sleep(0.02)
        began = time.monotonic()
        if after_s is not None and not full:
            try:
                process.wait(after_s)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.Signals[how])
        status = process.wait(LONGEST)
        words.seek(0)
        last = words.read().decode(errors="replace").strip().rpartition("\n")[2]
        says = re.sub(PLACE, "OUT", last)[-300:]
    held = len(list(out.rglob("*.kept"))) + sum(
        len(path.read_bytes().splitlines()) for path in out.rglob("*.jsonl")
    )
    return Ended(status, time.monotonic() - began, says, held)


def trial(command: str, seed: int, hows: tuple[str, ...], specs: Path, whole: "Whole") -> dict:
    """End a command at random moments, each time with --resume, let it finish, and compare."""
    rng, kills = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "out"
        line, more = line_of(command, specs, out), []
        for how in hows:
            after = float(rng.uniform(0.0, whole.worked_s))
            if how == "full":
                after = float(np.exp(rng.uniform(np.log(1e3), np.log(whole.largest))))
            end = ended(line + more, out, after, how)
            kills.append({"how": how, "after": round(after, 3), **end._asdict()})
            more = ["--resume"]
        last = ended(line + more, out)
        differ = whole.differ(out)
    met = [k for k in kills if k["status"] == TOLD[k["how"]]]
    late = [k for k in kills if k["status"] == whole.status and LOST not in k["says"]]
    return {
        "kills": kills,
        "met": len(met),
        "last": last._asdict(),
        "differ": differ,
        "right": not differ and last.status == whole.status and len(met) + len(late) == len(kills),
    }


class Whole(NamedTuple):
    """An uninterrupted run: its folder, exit status, seconds of work and its largest file."""

    out: Path
    status: int
    worked_s: float
    largest: int

    @classmethod
    def of(cls, command: str, specs: Path, out: Path) -> "Whole":
        """Run a command; what it compiles is kept for the trials."""
        end = ended(line_of(command, specs, out), out)
        sizes = [path.stat().st_size for path in out.rglob("*") if path.is_file()]
        if end.status not in (0, 1):
            raise RuntimeError(f"{command}: status {end.status}: {end.says}")
        return cls(out, end.status, end.worked_s, max(sizes))

    def differ(self, out: Path) -> list[str]:
        """Files of another run that do not say the same as this one's."""
        here, there = (dict(results(folder)) for folder in (self.out, out))
        return sorted(name for name in {**here, **there} if here.get(name) != there.get(name))


def results(out: Path) -> Iterator[tuple[str, Any]]:
    """What a run has written, by path: draws as bytes, tables and figures' numbers as they are."""
    import xarray as xr

    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        if path.suffix in (".csv", ".toml", ".tex", ".bib"):
            yield name, path.read_bytes()
        elif path.suffix == ".json":
            yield name, without_costs(json.loads(path.read_text("utf-8")))
        elif path.suffix == ".jsonl":
            rows = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
            last = {row["job"]: row for row in rows}  # a job that failed is tried again
            yield name, sorted(json.dumps([k, r["value"], r["failed"]]) for k, r in last.items())
        elif path.suffix == ".nc":
            with xr.open_datatree(path, engine="h5netcdf") as tree:
                for group in tree.subtree:
                    for variable in group.variables:
                        values = np.asarray(group[str(variable)])
                        yield f"{name}{group.path}/{variable}", values.tobytes()


def without_costs(value: Any) -> Any:
    """JSON without what it tells of times."""
    if isinstance(value, dict):
        return {key: without_costs(one) for key, one in value.items() if key not in COSTS}
    return [without_costs(one) for one in value] if isinstance(value, list) else value


def otherwise(row: dict) -> bool:
    """Whether all is the same, but a run ended with another status than it must."""
    lost = any(LOST in k["says"] for k in row["kills"])
    return not row["differ"] and (lost or not row["right"])


def page(rows: list[dict]) -> str:
    """The page of the study."""
    kills = Counter(
        (k["how"], r["case"]["command"])
        for r in rows
        for k in r["kills"]
        if k["status"] == TOLD[k["how"]]
    )
    real = sum(count for (how, _), count in kills.items() if how == "SIGKILL")
    out = [
        "# Runs that are killed\n",
        "A command on a small simulated spec is ended at random moments of its work and started\n"
        f"again with `--resume`, {KILLS} times; then it may finish. What it has written must be\n"
        "what an uninterrupted run writes: draws bit for bit, tables, JSON and the numbers\n"
        "behind figures letter for letter, times and costs left out. SIGKILL cannot be caught;\n"
        "*full* is a file system that takes no more (a limit on the size of files, at random\n"
        "between 1 kB and the largest file of the run), which must end with status 3 and a\n"
        "sentence. Moments that came after the end of a run are not counted.\n",
        "The chains of these fits are short, and most moments fall after them: kills within a\n"
        "chain and damaged blocks are tried by `tests/test_checkpoint.py`, damaged entries by\n"
        "`tests/test_shelf.py`, draws of bands stopped after each stretch by\n"
        "`tests/test_bands.py`.\n",
        f"`python tests/studies/kills.py --trials {len(rows)}`, code of "
        f"{', '.join(sorted({row['commit'] for row in rows}))}, {datetime.date.today()}: "
        f"{real} runs ended by SIGKILL.\n",
        "| command | trials | SIGKILL | SIGTERM | full | kept when ended | not the same "
        "| ended otherwise |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for command in (*COMMANDS, "all"):
        mine = [r for r in rows if command in ("all", r["case"]["command"])]
        counts = [
            sum(n for (how, name), n in kills.items() if how == h and command in ("all", name))
            for h in TOLD
        ]
        held = [k["held"] for r in mine for k in r["kills"]]
        between = f"{min(held)} to {max(held)}" if held else ""
        wrong = sum(bool(r["differ"]) for r in mine)
        other = sum(otherwise(r) for r in mine)
        cells = [command, len(mine), *counts, between, wrong, other]
        out.append("| " + " | ".join(map(str, cells)) + " |")
    out.append(
        "\n*Kept when ended*: entries of the store and rows of jobs that there were. *Ended\n"
        "otherwise*: all is the same, but a run ended with another status than it must. A `batch`\n"
        "of which one fit finds the disk full goes on with the others, keeps the failure as a row\n"
        "and ends with status 1. A SIGTERM in a callback where Python ignores errors was lost,\n"
        "and the run went on to its end; `tests/test_cli.py` holds that this is over.\n"
    )
    told = [
        f"- trial {r['case']['number']}, {r['case']['command']}: "
        + (", ".join(r["differ"]) or f"status {[k['status'] for k in r['kills']]}")
        for r in rows
        if r["differ"] or otherwise(r)
    ]
    return "\n".join(out + (["## Which\n", *told, ""] if told else []))


def main() -> int:
    args = options()
    path = args.out / "kills.jsonl"
    if not args.table:
        with tempfile.TemporaryDirectory() as name:
            specs = Path(name) / "specs"
            write_specs(specs)

            @functools.cache
            def whole(command: str) -> Whole:
                return Whole.of(command, specs, Path(name) / command)

            def one(case: Case) -> dict:
                hows = (case.how, *["SIGKILL"] * (KILLS - 1))
                found = trial(case.command, case.number, hows, specs, whole(case.command))
                return {"case": case._asdict(), **found}

            carry_out(path, cases(args.trials), one, lambda row: (row["met"], row["differ"][:3]))
    rows = lines_of([path])
    if rows:
        args.out.with_suffix(".md").write_text(page(rows), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
