"""Runs side by side, as values and as files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from rigid.io.files import locked
from rigid.report.compare import output
from rigid.report.compare.content import KIND, Compared, compared, content
from rigid.report.compare.runs import read_runs
from rigid.report.section import write_report
from rigid.study.result import CommandResult


@dataclass(frozen=True, eq=False)
class Comparison(CommandResult):
    """What a comparison found; the first run is the reference."""

    compared: Compared

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of compare.json."""
        return output.as_dict(self.compared)

    def moved(self) -> pd.DataFrame:
        """A row for each number and run: before, after, by how many standard deviations."""
        rows = [output.row(move) for moves in self.compared.moved for move in moves]
        return pd.DataFrame(rows, columns=list(output.COLUMNS))

    def table(self) -> str:
        """The same as text."""
        return output.table(self.compared)

    def write(self, folder: Path | str) -> None:
        """Write page, figures, compare.json and comparison.csv to a folder."""
        folder = Path(folder)
        with locked(folder):
            output.write(folder, self.compared)
            write_report(KIND, content(self.compared), folder)


def compare(paths: Sequence[Path | str]) -> Comparison:
    """Read runs and compare them with the first.

    - `paths`: folders of results, or a posterior.nc or result.json each.

    Raises InputError for fewer than two, and for what is no run.
    """
    return Comparison(compared(read_runs([Path(path) for path in paths])))
