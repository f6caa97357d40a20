"""`python -m rigid.laws SPEC`: which friction model the records speak for."""

import sys
from functools import partial

from rigid.io.cli import run
from rigid.study.command import ask

SAYS = "Compare laws of friction on the records: evidence, left-out records, and what parts them."
compare_laws = partial(ask, lambda study, out, **how: study.laws(out, **how))
"""Run the comparison and write its files; returns 0, or 1 if no model explains the records."""
main = partial(run, "laws", SAYS, compare_laws)

if __name__ == "__main__":
    sys.exit(main())
