"""`python -m rigid.discover SPEC`: where model and data disagree, and what is missing."""

import sys
from functools import partial

from rigid.io.cli import run
from rigid.study.command import ask

SAYS = "Find where model and data disagree, name the missing effect, add it, show the gap shrink."
discover = partial(ask, lambda study, out, **how: study.discover(out, **how))
"""Run the workflow and write its files; returns 0, or 1 if it must not be used."""
main = partial(run, "discover", SAYS, discover)

if __name__ == "__main__":
    sys.exit(main())
