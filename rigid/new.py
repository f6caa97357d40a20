"""`python -m rigid.new FILE...`: a spec to begin with, made from the headers of logger files."""

import argparse
import sys
from functools import partial
from pathlib import Path

from rigid.io.cli import Options, Takes, run

SAYS = "Write a spec to begin with from logger files: columns, units, and what is left to fill in."
OUT = Path("my-rig.toml")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare what this command alone takes."""
    parser.add_argument(
        "--kind",
        type=_kind,
        action="append",
        default=[],
        metavar="NAME=KIND",
        help="what was done in the file NAME, as in squeeze=frame; may be given several times",
    )


def _kind(text: str) -> tuple[str, str]:
    """Read the name of a record and its kind."""
    name, equals, kind = text.rpartition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"'{text}' is no NAME=KIND, as in squeeze=frame")
    return name, kind


TAKES = Takes(
    "logger files: a record each",
    count="many",
    switches={"force": "write over a spec that is there"},
    adds=add_options,
    out=f"the spec ({OUT})",
)


def new(options: Options) -> int:
    """Write the spec and say what is still to be filled in; returns 0."""
    from rigid.io.errors import InputError
    from rigid.io.files import write_text
    from rigid.records.starter import starter
    from rigid.spec import load_spec

    out = options.out or OUT
    if out.exists() and "force" not in options.switches:
        raise InputError(f"{out}: is there; give --out another name, or --force to write over it")
    write_text(out, starter(options.runs, dict(options.own["kind"]), out))
    lines = [f"{out}: written; look at every line that says 'guessed'"]
    try:
        load_spec(out)
    except InputError as error:
        lines += ["still to be filled in:", *str(error).splitlines()]
    sys.stdout.write("\n".join([*lines, f"then: rigid check {out}", ""]))
    return 0


main = partial(run, "new", SAYS, new, takes=TAKES)

if __name__ == "__main__":
    sys.exit(main())
