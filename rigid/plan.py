"""`python -m rigid.plan SPEC`: which record to take next."""

import argparse
import sys
from functools import partial

from rigid.io.cli import Options, Takes, run
from rigid.study.command import ask

SAYS = "Rank records that could be taken next by what each would tell of a quantity."


def _adds(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--of",
        action="append",
        metavar="QUANTITY",
        help="what the record is to tell: a parameter, or 'abs_mu[80 Hz]'; once for each, the "
        "first ranks (those of [plan], or k_LC and abs_mu[80 Hz])",
    )


def plan_records(options: Options) -> int:
    """Rank and write all files; returns 0, or 1 if the fit beneath must not be used."""
    quantities = tuple(options.own["of"] or ())
    return ask(lambda study, out, **how: study.plan(quantities, out, **how), options)


main = partial(run, "plan", SAYS, plan_records, takes=Takes(adds=_adds))

if __name__ == "__main__":
    sys.exit(main())
