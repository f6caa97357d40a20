"""Every spec of a folder fitted, one job each, and what all of them say together."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rigid.io.cli import Options
from rigid.io.errors import EnvironmentFaultError, InputError, RigidError
from rigid.io.files import locked, write_text
from rigid.io.progress import WRITE, say, stage
from rigid.io.provenance import running
from rigid.jobs.job import Given, Job
from rigid.jobs.run import run, told
from rigid.report.season.output import NOT_FITTED, as_dict, as_row, failed
from rigid.report.season.present import content, table
from rigid.report.season.section import KIND
from rigid.report.section import write_report
from rigid.spec import Spec, load_spec
from rigid.spec.opening import own_code, require_none_of_its_own
from rigid.spec.read import parse_spec
from rigid.study.result import CommandResult
from rigid.study.study import Study

ROWS = "rows.jsonl"
OUTSIDE = EnvironmentFaultError.status


@dataclass(frozen=True, eq=False)
class Season:
    """The specs of a folder.

    - `folder`; `listed`: its specs in the order of their names, or what is wrong with one.
    """

    folder: Path
    listed: Mapping[str, Spec | str]

    def fit(self, options: Options) -> "SeasonFit":
        """Fit every spec and write each report and the page over all.

        - `options`: its `out` is the folder of the results.

        Raises EnvironmentFaultError when the folder cannot be used or the workers are gone.
        """
        out = options.folder(self.folder)
        rows: dict[str, dict] = {}
        with locked(out):
            jobs, left_out = self._jobs(options, out)
            rows |= left_out
            with told(options, "campaigns", len(jobs)) as report:
                for row in run(
                    one, jobs, options.workers, out / ROWS,
                    resume=options.resume, folder=out, report=report,
                ):  # fmt: skip
                    rows[row["job"]] = as_row(row)
                    _say(options, row["job"], rows[row["job"]])
            done = SeasonFit(self.folder, [{"name": n} | rows[n] for n in self.listed])
            with stage(options.quiet, WRITE):
                done.write(out)
        return done

    def _jobs(self, options: Options, out: Path) -> tuple[list[Job], dict[str, dict]]:
        """Jobs of the specs that can be fitted, and rows of the others."""
        jobs, rows = [], {}
        for name, spec in self.listed.items():
            try:
                if isinstance(spec, str):
                    raise InputError(spec)
                if why := _nothing_to_fit(spec):
                    rows[name] = {"status": NOT_FITTED, "why": [why]}
                    continue
                if not options.own_code:
                    require_none_of_its_own(spec)
                jobs.append(_job(name, spec, options.seed, out / name))
            except RigidError as error:
                rows[name] = failed(error.status, str(error))
        return jobs, rows


@dataclass(frozen=True, eq=False)
class SeasonFit(CommandResult):
    """All fits of a season.

    - `folder`: of the specs. - `campaigns`: what is known of each, in order.
    """

    folder: Path
    campaigns: Sequence[Mapping[str, Any]]

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of batch.json."""
        return as_dict(self.folder, self.campaigns)

    @property
    def status(self) -> int:
        """Exit status: 3 where a fit could not finish for a reason outside its input."""
        outside = any(one.get("exit_status") == OUTSIDE for one in self.campaigns)
        return OUTSIDE if outside else super().status

    def table(self) -> str:
        """What the command prints."""
        return table(self.result)

    def write(self, out: Path) -> None:
        """Write batch.json and the page."""
        write_text(out / "batch.json", self.json())
        write_report(KIND, content(self.result), out)


def season(folder: Path) -> Season:
    """Read every spec of a folder.

    Raises InputError where there is no such folder or no spec in it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; name one that holds specs (*.toml)")
    paths = sorted(folder.glob("*.toml"), key=lambda path: in_order(path.stem))
    if not paths:
        raise InputError(f"{folder}: holds no spec; a spec is a file NAME.toml")
    return Season(folder, {path.stem: _read(path) for path in paths})


def in_order(name: str) -> list[tuple[int, str]]:
    """Sort key by which day-2 comes before day-10."""
    parts = re.split(r"(\d+)", name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def _read(path: Path) -> Spec | str:
    try:
        return load_spec(path)
    except InputError as error:
        return str(error)


def _nothing_to_fit(spec: Spec) -> str | None:
    if spec.published is not None:
        return "the spec has [published] numbers and no records; fit it alone"
    if not any(record.fit for record in spec.records):
        return "the spec has no record to fit (field records are for rigid.bands)"
    return None


def _job(name: str, spec: Spec, seed: int | None, out: Path) -> Job:
    """The job of a spec: its text, and what it reads.

    - `out`: folder of its results.
    """
    path = spec.path.resolve()
    arguments = {
        "path": str(path),
        "text": spec.text,
        "seed": seed,
        "spec_folder": Path(os.path.relpath(path.parent, out.resolve())).as_posix(),
    }
    return Job(name, arguments, tuple(dict.fromkeys(_files(spec))))


def _files(spec: Spec) -> Iterator[Path]:
    """Absolute paths of the records that are fitted and of the spec's own code.

    Those that cannot be read are left out: the fit says best what is wrong with a record, and code
    without a file is that of a package, which the workers must have.
    """
    modules = [name.split(":")[0].removesuffix(".py") for name in own_code(spec)]
    listed = [record.file for record in spec.records if record.fit]
    for path in (*listed, *(spec.path.parent / f"{module}.py" for module in modules)):
        if path.is_file() and os.access(path, os.R_OK):
            yield Path(os.path.abspath(path))


def one(given: Given) -> dict[str, Any]:
    """Fit a spec and leave its files; the row: verdict, table, gap and cost.

    Raises what `Study.fit` raises.
    """
    asked = given.arguments
    study = Study(parse_spec(asked["text"], given.path(asked["path"])))
    with running(f"python -m rigid.fit {Path(asked['path']).stem}"):
        found = study.fit(seed=asked["seed"], quiet=True)
        found.write(given.out, spec_folder=asked["spec_folder"])
    made = found.result
    return {
        "title": study.spec.title,
        "simulated": study.spec.simulated,
        "usable": made.usable,
        "why": [check.says for check in made.checks if not check.ok],
        "gap": made.gap.overall,
        "settings": [p.label for p in study.problem.parameters.sampled if p.record],
        "parameters": {row.name: row.values() for row in made.parameters},
        "seed": made.seed,
    }


def _say(options: Options, name: str, row: Mapping[str, Any]) -> None:
    why = f": {'; '.join(row['why'])}" if row["why"] else ""
    say(options.quiet, f"{name}: {row['status']}{why}")
