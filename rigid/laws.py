"""`python -m rigid.laws SPEC`: which friction model the records speak for."""

import argparse
import sys
from functools import partial

from rigid.io.cli import Options, Takes, run
from rigid.study.command import ask

SAYS = "Compare laws of friction on the records: evidence, left-out records, and what parts them."


def _adds(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--joint",
        metavar="NAME",
        help="joint of the spec's machine at which laws are compared (the only one that rubs)",
    )


def compare_laws(options: Options) -> int:
    """Run the comparison and write its files; returns 0, or 1 if no model explains the records."""
    joint = options.own.get("joint")
    return ask(lambda study, out, **how: study.laws(out, joint=joint, **how), options)


main = partial(run, "laws", SAYS, compare_laws, takes=Takes(adds=_adds))

if __name__ == "__main__":
    sys.exit(main())
