"""`python -m rigid.compare RUN RUN ...`: runs side by side: what moved, and why."""

import sys
from pathlib import Path

from rigid.io.cli import Options, Takes, run
from rigid.io.progress import WRITE, stage
from rigid.study.command import tell

SAYS = "Set runs side by side: what moved, which records disagree, what differs."
TAKES = Takes(
    "folders of results, or a posterior.nc or result.json each; the first is the reference",
    count="many",
)


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("compare", SAYS, compare_runs, arguments, TAKES)


def compare_runs(options: Options) -> int:
    """Compare and write all files; returns 0, or 1 if a run must not be used."""
    from rigid.study.compare import compare

    found = compare(options.runs)
    folder = options.folder(Path("compare"))
    with stage(options.quiet, WRITE):
        found.write(folder)
    return tell(options, folder, found)


if __name__ == "__main__":
    sys.exit(main())
