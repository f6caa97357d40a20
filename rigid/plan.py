"""`python -m rigid.plan SPEC`: which record to take next."""

import argparse
import sys
from functools import partial

from rigid.io.cli import Options, Takes, run
from rigid.io.errors import InputError
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
    parser.add_argument(
        "--between",
        nargs=2,
        metavar="EFFECT",
        help="rank by how far each record tells two effects apart that the model may lack",
    )


def plan_records(options: Options) -> int:
    """Rank and write all files; returns 0, or 1 if the fit beneath must not be used."""
    quantities, pair = tuple(options.own["of"] or ()), options.own["between"]
    if pair and quantities:
        raise InputError("--between and --of ask for two rankings; run the command for each")
    if pair:
        return ask(lambda study, out, **how: study.plan_between(*pair, out, **how), options)
    return ask(lambda study, out, **how: study.plan(quantities, out, **how), options)


main = partial(run, "plan", SAYS, plan_records, takes=Takes(adds=_adds))

if __name__ == "__main__":
    sys.exit(main())
