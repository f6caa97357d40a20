"""`python -m rigid.discover SPEC`: where model and data disagree, and what is missing."""

import sys

from rigid.io.cli import Options, run
from rigid.study.command import ask

SAYS = "Find where model and data disagree, name the missing effect, add it, show the gap shrink."


def main(arguments: list[str] | None = None) -> int:
    """Run the command."""
    return run("discover", SAYS, discover, arguments)


def discover(options: Options) -> int:
    """Run the workflow and write its files; returns 0, or 1 if it must not be used."""
    return ask(options, lambda study, out, **how: study.discover(out, **how))


if __name__ == "__main__":
    sys.exit(main())
