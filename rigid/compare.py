"""`python -m rigid.compare RUN RUN ...`: runs side by side: what moved, and why."""

import sys
from functools import partial
from pathlib import Path

from rigid.io.cli import Options, Takes, run
from rigid.study.command import write_and_tell

SAYS = "Set runs side by side: what moved, which records disagree, what differs."
TAKES = Takes(
    "folders of results, or a posterior.nc or result.json each; the first is the reference",
    count="many",
)


def compare_runs(options: Options) -> int:
    """Compare and write all files; returns 0, or 1 if a run must not be used."""
    from rigid.study.compare import compare

    return write_and_tell(options, Path("compare"), compare(options.runs))


main = partial(run, "compare", SAYS, compare_runs, takes=TAKES)

if __name__ == "__main__":
    sys.exit(main())
