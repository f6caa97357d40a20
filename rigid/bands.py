"""`python -m rigid.bands SPEC`: posterior and field records to ice load and displacement."""

import sys
from functools import partial

from rigid.io.cli import run
from rigid.study.command import ask

SAYS = "Ice load and plate displacement from field records, with uncertainty bands."
bands = partial(ask, lambda study, out, **how: study.write_bands(out, **how))
"""Make the bands of every field record; returns 0, or 1 if they must not be used."""
main = partial(run, "bands", SAYS, bands)

if __name__ == "__main__":
    sys.exit(main())
