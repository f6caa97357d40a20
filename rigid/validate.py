"""`python -m rigid.validate SPEC`: do its posteriors hold the truth as often as they say?"""

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid.io.cli import Options, Takes, run
from rigid.study.command import ask

if TYPE_CHECKING:
    from rigid.study.result import CommandResult
    from rigid.study.study import Study

SAYS = "Draw campaigns from a spec, fit them, and test what the posteriors say of the truths."
WAYS = ("noise-halved", "rounding-ignored", "colour-ignored", "record-twice")
SHIFT = 2.0
"""Prior sds of a misfit where none are given."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options that this command alone has."""
    parser.add_argument(
        "--replicates", type=_count, default=100, metavar="N", help="campaigns (100)"
    )
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--full", action="store_true", help="fit each as rigid.fit does; slow")
    how.add_argument(
        "--slopes",
        action="store_true",
        help="fit none: test the likelihood alone, by its slope at the truth; seconds a campaign",
    )
    parser.add_argument(
        "--from",
        dest="posterior",
        type=Path,
        metavar="POSTERIOR",
        help="draw around a posterior.nc, in place of the whole prior",
    )
    parser.add_argument(
        "--misfit",
        nargs="?",
        type=float,
        const=SHIFT,
        default=0.0,
        metavar="SDS",
        help=f"draw each constant of the rig so many prior sds from its prior in turn ({SHIFT:g})",
    )
    parser.add_argument(
        "--break",
        dest="broken",
        choices=WAYS,
        help="break the likelihood on purpose, to see the validation fail",
    )
    parser.add_argument(
        "--discover",
        type=_count,
        default=0,
        metavar="N",
        help="count false alarms of rigid discover on N of the campaigns; a minute or more each",
    )


def _count(text: str) -> int:
    """Read a number of campaigns."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"'{text}' is no number of campaigns; 1 or more")
    return int(text)


def validate(options: Options) -> int:
    """Run the replicates and write all files; returns 0, or 1 if the posteriors are not sound."""

    def validated(study: "Study", out: Path, **how: Any) -> "CommandResult":
        from rigid.study.validation import Replicates

        own = options.own
        fit = "slopes" if own["slopes"] else "full" if own["full"] else "fast"
        asked = Replicates(
            own["replicates"],
            fit,
            own["posterior"],
            own["misfit"],
            own["broken"],
            own["discover"],
        )
        return study.validate(asked, out, workers=options.workers, **how)

    return ask(validated, options)


main = partial(run, "validate", SAYS, validate, takes=Takes(workers=True, adds=add_options))

if __name__ == "__main__":
    sys.exit(main())
