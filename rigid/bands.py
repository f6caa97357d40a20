"""`python -m rigid.bands SPEC`: posterior and field records to ice load and displacement."""

import sys

from rigid.io.cli import Options, run
from rigid.study.command import ask

SAYS = "Ice load and plate displacement from field records, with uncertainty bands."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("bands", SAYS, bands, arguments)


def bands(options: Options) -> int:
    """Make the bands of every field record; returns 0, or 1 if they must not be used."""
    return ask(options, lambda study, out, **how: study.write_bands(out, **how))


if __name__ == "__main__":
    sys.exit(main())
