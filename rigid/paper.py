"""`python -m rigid.paper`: the paper, its equations, numbers and figures, computed again."""

import sys
from functools import partial

from rigid.io.cli import Options, Takes, run
from rigid.study.command import write_and_tell

SAYS = "Compute the paper again: equations (2) to (23), every printed number, and its figures."
NO_FIT = "no-fit"
TAKES = Takes(
    count="none",
    switches={NO_FIT: "leave out the fit to the printed numbers, which takes some minutes"},
)


def paper(options: Options) -> int:
    """Compute and write all files; returns 0, or 1 if something differs without a reason."""
    from rigid.io.runtime import prepare

    prepare(as_command=True)
    from rigid.study.paper import reproduce

    found = reproduce(
        seed=options.seed,
        fit=NO_FIT not in options.switches,
        quiet=options.quiet,
    )
    return write_and_tell(options, found.spec.path, found)


main = partial(run, "paper", SAYS, paper, takes=TAKES)

if __name__ == "__main__":
    sys.exit(main())
