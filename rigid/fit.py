"""`python -m rigid.fit SPEC`: records to posterior to report. The pipeline on one page."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid.io.cli import run
from rigid.study.command import ask

if TYPE_CHECKING:
    from rigid.study.result import CommandResult
    from rigid.study.study import Study

SAYS = "Calibrate a rig: records in, posterior of its parameters and a report out."


def fitted(study: "Study", out: Path, **how: Any) -> "CommandResult":
    """Fit records, or the numbers that a paper prints, and write all files."""
    from rigid.study.published import fit_published

    if study.spec.published is None:
        return study.fit(out, **how)
    seed = study.spec.sampler.seed if how["seed"] is None else how["seed"]
    return fit_published(study.spec, out, seed, how["quiet"])


fit = partial(ask, fitted)
"""Calibrate and write all files; returns 0, or 1 if the result must not be used."""
main = partial(run, "fit", SAYS, fit)

if __name__ == "__main__":
    sys.exit(main())
