"""`python -m rigid.batch FOLDER`: every spec of a folder fitted, and one page over all."""

import sys
from functools import partial
from pathlib import Path

from rigid.io.cli import Options, Takes, run
from rigid.study.command import tell

SAYS = "Fit every spec of a folder; one page over all: quantities with uncertainty, what drifts."
TAKES = Takes("a folder of specs (*.toml)", workers=True)


def batch(options: Options) -> int:
    """Fit all specs and write all files; returns 0, or 1 if any result must not be used."""
    from rigid.io.runtime import prepare

    prepare(as_command=True)
    from rigid.study.season import season

    folder = Path(options.spec)
    return tell(options, options.folder(folder), season(folder).fit(options))


main = partial(run, "batch", SAYS, batch, takes=TAKES)

if __name__ == "__main__":
    sys.exit(main())
