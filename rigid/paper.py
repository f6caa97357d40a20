"""`python -m rigid.paper`: the paper, its equations, numbers and figures, computed again."""

import sys

from rigid.io.cli import Options, Takes, run
from rigid.io.progress import WRITE, stage
from rigid.study.command import tell

SAYS = "Compute the paper again: equations (2) to (23), every printed number, and its figures."
NO_FIT = "no-fit"
TAKES = Takes(
    count="none",
    switches={NO_FIT: "leave out the fit to the printed numbers, which takes some minutes"},
)


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("paper", SAYS, paper, arguments, TAKES)


def paper(options: Options) -> int:
    """Compute and write all files; returns 0, or 1 if something differs without a reason."""
    from rigid.io.runtime import prepare

    prepare()
    from rigid.study.paper import reproduce

    found = reproduce(
        seed=options.seed,
        fit=NO_FIT not in options.switches,
        quiet=options.quiet,
    )
    folder = options.folder(found.spec.path)
    with stage(options.quiet, WRITE):
        found.write(folder)
    return tell(options, folder, found)


if __name__ == "__main__":
    sys.exit(main())
