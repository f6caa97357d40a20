"""The paper computed again, as values and as files."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from rigid.io.files import locked, write_text
from rigid.io.progress import stages
from rigid.io.provenance import invocation
from rigid.published.run import Findings
from rigid.published.walk.walk import Walk, walk
from rigid.report.paper import output
from rigid.report.paper.content import KIND, content
from rigid.report.section import write_report
from rigid.spec import Spec, find_spec, load_spec
from rigid.study.published import PublishedFit, explained
from rigid.study.result import CommandResult


@dataclass(frozen=True, eq=False)
class Paper(CommandResult):
    """What was computed of the paper.

    - `spec`: the printed numbers that are fitted. - `walk`: numbers, equations, figures.
    - `findings`: of the fit to the printed numbers; None where it was left out.
    """

    spec: Spec
    walk: Walk
    findings: Findings | None

    @cached_property
    def result(self) -> dict[str, Any]:
        """All of result.json."""
        return output.result(self.spec, self.walk, self.findings, invocation().wall_s)

    def items(self) -> pd.DataFrame:
        """A row for each printed number, equation and figure: printed, computed, verdict."""
        return pd.DataFrame(self.result["items"]).set_index("name")

    def table(self) -> str:
        """The items as text."""
        return output.table(self.walk)

    def write(self, folder: Path | str) -> None:
        """Write page, figures and result.json to a folder; with the fit, its files as well."""
        folder = Path(folder)
        with locked(folder):
            if self.findings is not None:
                PublishedFit(self.spec, self.findings, invocation().wall_s).write(folder)
            write_text(folder / "result.json", self.json())
            write_report(KIND, content(self.spec, self.walk), folder)


def reproduce(
    *,
    seed: int | None = None,
    fit: bool = True,
    quiet: bool = False,
) -> Paper:
    """Compute the paper again.

    - `seed`: of the draws; None: that of the shipped spec. - `fit`: whether to fit the printed
      numbers as well, which takes some minutes. - `quiet`: no progress on standard error.
    """
    spec = load_spec(find_spec("paper"))
    seed = spec.sampler.seed if seed is None else seed
    with stages(quiet) as follow:
        walked = walk(seed, follow)
    return Paper(spec, walked, explained(spec, seed, quiet) if fit else None)
