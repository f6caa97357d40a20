"""`python -m rigid.laws SPEC`: which friction model the records speak for."""

import sys

from rigid.io.cli import Options, run
from rigid.study.command import ask

SAYS = "Compare laws of friction on the records: evidence, left-out records, and what parts them."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("laws", SAYS, compare_laws, arguments)


def compare_laws(options: Options) -> int:
    """Run the comparison and write its files; returns 0, or 1 if no model explains the records."""
    return ask(options, lambda study, out, **how: study.laws(out, **how))


if __name__ == "__main__":
    sys.exit(main())
