"""`python -m rigid.fit SPEC`: records to posterior to report. The pipeline on one page."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid.io.cli import Options, run
from rigid.study.command import ask

if TYPE_CHECKING:
    from rigid.study.result import CommandResult
    from rigid.study.study import Study

SAYS = "Calibrate a rig: records in, posterior of its parameters and a report out."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("fit", SAYS, fit, arguments)


def fit(options: Options) -> int:
    """Calibrate and write all files; returns 0, or 1 if the result must not be used."""

    def fitted(study: "Study", out: Path, **how: Any) -> "CommandResult":
        from rigid.study.published import fit_published

        spec = study.spec
        if spec.published is None:
            return study.fit(out, **how)
        seed = spec.sampler.seed if options.seed is None else options.seed
        return fit_published(spec, out, seed, options.quiet)

    return ask(options, fitted)


if __name__ == "__main__":
    sys.exit(main())
