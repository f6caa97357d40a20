"""How a command asks a study and tells the result.

The module itself loads nothing heavy: a command prints its first line before JAX is there.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rigid.io.cli import Options
from rigid.io.progress import WRITE, painted, say, stage, times

if TYPE_CHECKING:
    from rigid.study.compare import Comparison
    from rigid.study.paper import Paper
    from rigid.study.result import CommandResult


def ask(question: "Callable[..., CommandResult]", options: Options) -> int:
    """Put a question to the study of the spec that the options name, and tell the result.

    - `question`: takes the study, the folder of the files, `seed`, `resume` and `quiet`.

    Returns the exit status, 1 for a result that must not be used. Raises InputError for a mistake
    in the spec, and what the question raises.
    """
    from rigid.io.runtime import loading, prepare

    with loading():
        from rigid.spec.opening import open_spec

        spec = open_spec(options)
        prepare(as_command=True)
        from rigid.study.study import Study

    how = {"seed": options.seed, "resume": options.resume, "quiet": options.quiet}
    folder = options.folder(spec.path)
    return tell(options, folder, question(Study(spec), folder, **how))


def write_and_tell(options: Options, named: Path, found: "Comparison | Paper") -> int:
    """Write the files of a result to the folder of what is `named`, and tell it."""
    folder = options.folder(named)
    with stage(options.quiet, WRITE):
        found.write(folder)
    return tell(options, folder, found)


def tell(options: Options, folder: Path, found: "CommandResult") -> int:
    """Print a result, and where its report lies; returns the command's status.

    The result goes to standard output, all else to standard error: checks that failed even where
    the command is to be quiet, what was held exact and set aside, the time of each stage, the page.
    """
    from rigid.report.taken import lines

    sys.stdout.write(found.json() if options.as_json else found.table())
    for check in found.checks:
        if not check.ok:
            sys.stderr.write(f"{painted(check.name, 'red')}: {check.says}\n")
    for line in (*(lines(found.taken) if found.taken else ()), *times()):
        say(options.quiet, line)
    say(options.quiet, painted(f"report: {folder / 'index.html'}", "bold"))
    return found.status
