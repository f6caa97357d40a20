"""What a person waits for: fits and discovery as commands, each in a process of its own.

Rows with programs kept come after those that made them, in one folder of programs. The second
campaign is another seed of the generator: other lengths of all records.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from campaign import ROOT, SPEC, Bench
from joint import lsoda
from table import Row
from wall import LIGHT

SECOND, HIDDEN = 4711, 4712
"""Seeds of the generator, for the second campaign and for one with dry friction hidden."""
LOOK = 0.05
"""Seconds between two looks at what a command has written."""
ANSWERED = (0, 1)
"""Statuses of a command that has come to its end."""


@dataclass(frozen=True)
class Taken:
    """One run of a command.

    - `wall`, `cpu` [s]: to its end. - `first` [s]: until the first best fit stood in result.json;
      None where none did. - `result`: result.json.
    """

    wall: float
    cpu: float
    first: float | None
    result: dict


def taken(arguments: Sequence[str], folder: Path, cache: Path) -> Taken:
    """Run a command of rigid into a folder."""
    command = (sys.executable, "-m", "rigid", *arguments, "--out", str(folder), "--quiet")
    given = os.environ | {"RIGID_CACHE": str(cache)}
    given.pop("OPENBLAS_NUM_THREADS", None)  # the command as its user calls it
    result, first, began = folder / "result.json", None, time.perf_counter()
    with tempfile.TemporaryFile() as said:
        run = subprocess.Popen(command, cwd=ROOT, env=given, stdout=said, stderr=said)
        while True:
            pid, ended, used = os.wait4(run.pid, os.WNOHANG)
            if pid:
                break
            if first is None and result.exists():
                first = time.perf_counter() - began
            time.sleep(LOOK)
        run.returncode = os.waitstatus_to_exitcode(ended)
        wall = time.perf_counter() - began
        if run.returncode not in ANSWERED:
            said.seek(0)
            raise RuntimeError(said.read().decode())
    told = json.loads(result.read_text("utf-8")) if result.exists() else {}
    return Taken(wall, used.ru_utime + used.ru_stime, first, told)


def generated(seed: int, folder: Path, quick: bool, *more: str) -> Path:
    """Simulate a campaign and return the spec to fit."""
    command = (sys.executable, "-m", "rigid.generator", "--seed", str(seed), "--no-field", *more)
    subprocess.run((*command, "--out", str(folder)), cwd=ROOT, check=True, capture_output=True)
    return _lightened(folder / "calibration.toml", quick)


def _lightened(spec: Path, quick: bool) -> Path:
    if quick:
        spec.write_text(spec.read_text("utf-8") + LIGHT, "utf-8")
    return spec


def rows(bench: Bench) -> list[Row]:
    """Wall times of fits, processor times of discovery, and what a draw takes."""
    with tempfile.TemporaryDirectory() as place:
        return [*_fits(bench, Path(place)), *_discoveries(bench, Path(place)), *_draws(bench)]


def _fits(bench: Bench, place: Path) -> list[Row]:
    spec = place / SPEC.name
    spec.write_text(SPEC.read_text("utf-8").replace('"../data/', f'"{ROOT}/data/'), "utf-8")
    _lightened(spec, bench.quick)
    cache = place / "fits"
    ever = taken(("fit", str(spec)), place / "ever", cache)
    again = [
        taken(("fit", str(spec)), place / f"again-{i}", cache) for i in range(bench.choose(1, 3))
    ]
    kept = statistics.median(one.wall for one in again)
    kept_first = statistics.median(one.first or one.wall for one in again)
    other = generated(SECOND, place / "second", bench.quick)
    second = taken(("fit", str(other)), place / "second-fit", cache)
    cost = again[0].result["cost"]
    each = 1000.0 * cost["evaluations"] / (cost["ess_min"] or 1.0)
    what = "`rigid fit calibration`"
    return [
        _seconds(f"{what}, first ever, to the first best fit", ever.first or ever.wall, 15.0),
        _seconds(f"{what}, first ever, to the report", ever.wall, 60.0),
        _seconds(f"{what}, programs kept, to the first best fit", kept_first, None),
        _seconds(f"{what}, programs kept, to the report", kept, 25.0),
        _seconds("a second campaign of other record lengths, to the report", second.wall, 30.0),
        Row(
            "evaluations for 1,000 effective draws, reference campaign",
            "-",
            f"{each:.0f}",
            "6,000",
            each <= 6000.0,
            (f"{cost['evaluations']} for a least ESS of {cost['ess_min']:.0f}; the search and the "
             "law that is fitted around its modes come before",),
        ),
    ]  # fmt: skip


def _discoveries(bench: Bench, place: Path) -> list[Row]:
    cache = place / "discoveries"
    spec = generated(HIDDEN, place / "hidden", bench.quick, "--hide", "coulomb-friction")
    ever = taken(("discover", str(spec)), place / "found", cache)
    kept = taken(("discover", str(spec)), place / "found-again", cache)
    taken(("fit", str(spec)), place / "fitted", cache)
    fit = taken(("fit", str(spec)), place / "fitted-again", cache)
    beside = kept.cpu / fit.cpu
    return [
        _seconds("`discover`, eight records, first ever", ever.cpu, 60.0, "core-s"),
        _seconds("`discover`, eight records, programs kept", kept.cpu, 25.0, "core-s"),
        Row(
            "`discover` beside `fit` of the same records",
            "programs kept, core-s",
            f"{beside:.2g} times ({kept.cpu:.0f} and {fit.cpu:.0f} core-s)",
            "1",
            beside <= 1.0,
        ),
    ]


def _draws(bench: Bench) -> list[Row]:
    core = bench.speed.per_walker * bench.speed.cores_used
    theirs = lsoda(bench).seconds
    return [
        Row(
            "log-posterior of the reference campaign, both on one core",
            "SciPy LSODA (`odeint`)",
            f"{theirs / core:.0f} times",
            "600 times",
            theirs / core >= 600.0,
            (f"{1e3 * core:.3g} ms of a core a walker, {1e3 * theirs:.0f} ms LSODA",),
        )
    ]


def _seconds(what: str, found: float, bar: float | None, unit: str = "s") -> Row:
    asked = "-" if bar is None else f"{bar:g} {unit}"
    return Row(what, "-", f"{found:.0f} {unit}", asked, None if bar is None else found <= bar)
