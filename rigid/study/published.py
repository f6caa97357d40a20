"""A fit to the numbers that a paper prints, as values and as files."""

import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rigid.io.errors import InputError
from rigid.io.files import locked, plain
from rigid.io.progress import WRITE, stage
from rigid.published.run import COUNT, Findings, run
from rigid.report.published import output
from rigid.report.published.present import content
from rigid.report.published.section import KIND
from rigid.report.section import write_report
from rigid.spec import Spec
from rigid.study.result import CommandResult


@dataclass(frozen=True, eq=False)
class PublishedFit(CommandResult):
    """What printed numbers say.

    - `spec`: with the numbers. - `findings`: all that was worked out. - `wall_s`: time it took [s].
    """

    spec: Spec
    findings: Findings
    wall_s: float

    @cached_property
    def result(self) -> dict[str, Any]:
        """All of result.json."""
        return plain(output.as_dict(self.spec, self.findings, self.wall_s))

    def table(self) -> str:
        """What the command prints."""
        return output.table(self.findings)

    def write(self, folder: Path) -> None:
        """Write posterior.nc, summary.csv, result.json and the page."""
        output.write(folder, self.spec, self.findings, self.result)
        write_report(KIND, content(self.spec, self.findings), folder)


def fit_published(spec: Spec, folder: Path, seed: int, quiet: bool) -> PublishedFit:
    """Tell all stories and write all files.

    - `seed`: of the points. - `quiet`: no progress on standard error.

    Raises InputError for a spec that names records as well.
    """
    if spec.records:
        raise InputError(
            f"{spec.path}: has [published] numbers and {len(spec.records)} records; a fit takes "
            "one or the other, put them into two specs"
        )
    began = time.monotonic()
    with locked(folder):
        found = PublishedFit(spec, explained(spec, seed, quiet), time.monotonic() - began)
        with stage(quiet, WRITE):
            found.write(folder)
    return found


def explained(spec: Spec, seed: int, quiet: bool) -> Findings:
    """Fit the printed numbers under every hypothesis."""
    with stage(quiet, "fit the printed numbers", COUNT, "fits") as shown:
        return run(spec, seed, shown.reach)
