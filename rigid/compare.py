"""`python -m rigid.compare RUN RUN ...`: runs side by side: what moved, and why."""

import sys
from pathlib import Path

from rigid.io.cli import Options, Takes, run, say

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
    found.write(folder)
    sys.stdout.write(found.json() if options.as_json else found.table())
    for check in found.checks:
        if not check.ok:
            sys.stderr.write(f"{check.name}: {check.says}\n")
    say(options, f"report: {folder / 'index.html'}")
    return 0 if found.usable else 1


if __name__ == "__main__":
    sys.exit(main())
