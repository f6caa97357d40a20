"""What all commands share: options, the first line, progress, exit status."""

import argparse
import contextlib
import os
import shlex
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import FrameType
from typing import Any, Literal

from rigid.io.errors import RigidError
from rigid.io.progress import painted, say
from rigid.io.provenance import running
from rigid.io.version import __version__

TRACEBACK = "RIGID_TRACEBACK"
"""Environment variable that shows where a defect of the program is."""
SOON = 0.05
"""Seconds after which a signal is raised once more."""


@dataclass(frozen=True)
class Options:
    """Options of a command.

    - `spec`: name or path. - `out`: folder of the results, None for `reports/<name>/`.
    - `seed`: in place of the spec's. - `resume`, `quiet`, `as_json`: as on the command line.
    - `own_code`: whether a spec may bring code along.
    - `workers`: number of processes, or address of a Dask scheduler; None: this process.
    - `runs`: folders or files of a command that takes several, in place of a spec.
    - `switches`: those of the command's own that were given.
    - `own`: options that this command alone has, by name.
    """

    spec: str
    out: Path | None
    seed: int | None
    resume: bool
    quiet: bool
    as_json: bool
    own_code: bool = True
    workers: int | str | None = None
    runs: tuple[Path, ...] = ()
    switches: frozenset[str] = frozenset()
    own: Mapping[str, Any] = field(default_factory=dict)

    def folder(self, spec_path: Path) -> Path:
        """Folder of the results for a spec."""
        return self.out if self.out is not None else Path("reports") / spec_path.stem


class Interrupted(BaseException):
    """A signal asked the run to end."""

    def __init__(self, number: int):
        super().__init__(number)
        self.number = number


@dataclass(frozen=True)
class Takes:
    """What a command's line takes beside the options of all.

    - `what`: the sort of its argument, as `--help` names it. - `workers`: whether it has jobs for
      other processes or machines.
    - `count`: "one" spec, "many" runs, or "none". - `switches`: help by name of its own switches.
    - `adds`: declares options of its own that take a value. - `out`: help of `--out`.
    """

    what: str = "a spec: its path, or NAME of fits/NAME.toml or a shipped one"
    workers: bool = False
    count: Literal["one", "many", "none"] = "one"
    switches: Mapping[str, str] = field(default_factory=dict)
    adds: Callable[[argparse.ArgumentParser], None] = lambda _: None
    out: str = "folder of the results (reports/<name>/)"


SPEC = Takes()


def parse(
    command: str, says: str, arguments: list[str] | None = None, takes: Takes = SPEC
) -> Options:
    """Read the command line; a mistake ends the program with status 2 and one message."""
    script = Path(sys.argv[0]).name in ("rigid", "rigid.exe", "__main__.py")
    prog = f"rigid {command}" if script else f"python -m rigid.{command}"
    parser = argparse.ArgumentParser(prog=prog, description=says, allow_abbrev=False)
    if takes.count == "one":
        parser.add_argument("spec", help=takes.what)
    elif takes.count == "many":
        parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help=takes.what)
    parser.add_argument("--out", type=Path, help=takes.out)
    parser.add_argument("--seed", type=_seed, help="seed, in place of the spec's")
    parser.add_argument("--resume", action="store_true", help="go on with an interrupted run")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
    parser.add_argument("--json", action="store_true", dest="as_json", help="print result.json")
    parser.add_argument(
        "--no-own-code",
        action="store_false",
        dest="own_code",
        help="refuse a spec that runs code of its own (module:Class)",
    )
    parser.add_argument(
        "--workers",
        type=_workers,
        metavar="N|ADDRESS",
        help="worker processes to start here, or the address of a Dask scheduler"
        if takes.workers
        else argparse.SUPPRESS,
    )
    for name, help_text in takes.switches.items():
        parser.add_argument(
            f"--{name}", action="append_const", const=name, dest="switches", help=help_text
        )
    parser.add_argument("--version", action="version", version=f"rigid {__version__}")
    takes.adds(parser)
    read = vars(parser.parse_args(arguments))
    read["runs"] = tuple(read.get("runs", ()))
    read["switches"] = frozenset(read.get("switches") or ())
    known = {f.name for f in fields(Options)}
    read["own"] = {name: read.pop(name) for name in [*read] if name not in known}
    given = Options(**{"spec": " ".join(map(str, read["runs"])), **read})
    if given.workers is not None and not takes.workers:
        parser.error(
            f"--workers {given.workers}: this command is one job and runs in this process; "
            "leave --workers out"
        )
    return given


def _workers(text: str) -> int | str:
    """Read a number of processes, 1 or more, or an address, host:port."""
    if text.isdecimal() and int(text) > 0:
        return int(text)
    if ":" in text:
        return text
    raise argparse.ArgumentTypeError(
        f"'{text}' is neither a number of processes (1 or more) nor the address of a Dask "
        "scheduler (tcp://host:8786)"
    )


def _seed(text: str) -> int:
    """Read a seed; random numbers take none below 0."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is no seed; it is a whole number, 0 or more")
    return int(text)


@contextlib.contextmanager
def signals() -> Iterator[None]:
    """Turn SIGINT and SIGTERM into `Interrupted`, so that files are closed on the way out.

    In the main thread; no other may set handlers, and it is not there that signals arrive. Raised
    where Python ignores all errors (a callback of the garbage collector), it is raised once more.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _frame: FrameType | None) -> None:
        raise Interrupted(number)

    def ignored(told: "sys.UnraisableHookArgs") -> None:
        if not isinstance(told.exc_value, Interrupted):
            hook(told)
            return
        number = told.exc_value.number
        signal.signal(signal.SIGALRM, lambda *_: stop(number, None))
        signal.setitimer(signal.ITIMER_REAL, SOON)

    hook, sys.unraisablehook = sys.unraisablehook, ignored
    before = {n: signal.signal(n, stop) for n in (signal.SIGINT, signal.SIGTERM)}
    before[signal.SIGALRM] = signal.getsignal(signal.SIGALRM)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook


def run(
    command: str,
    says: str,
    body: Callable[[Options], int],
    arguments: list[str] | None = None,
    takes: Takes = SPEC,
) -> int:
    """Run a command and return its exit status; failures become one message, no traceback.

    - `body`: does the work and returns 0 or 1. - `arguments`: None: those of the process.
    """
    options = parse(command, says, arguments, takes)
    say(options.quiet, f"rigid {__version__}: {command} {options.spec}".rstrip())
    try:
        with signals(), running(_as_typed(command, arguments)):
            status = body(options)
            sys.stdout.flush()
            return status
    except Interrupted as stop:
        sys.stderr.write("interrupted; --resume goes on from the last complete block\n")
        return 128 + stop.number
    except RigidError as error:
        sys.stderr.write(f"{painted(str(error), 'red')}\n")
        return error.status
    except BrokenPipeError:  # whoever read the result has seen enough of it
        _drop_output()
        return 0
    except OSError as error:
        _drop_output()
        sys.stderr.write(f"the system refused: {error}\n")
        return 3
    except MemoryError:
        sys.stderr.write("out of memory; fewer walkers ([sampler] walkers) need less\n")
        return 3
    except Exception as error:  # the last resort: a defect is told from a fault of the input
        if os.environ.get(TRACEBACK):
            raise
        told = " ".join(f"{type(error).__name__}: {error}".split())
        sys.stderr.write(
            f"a defect of the program: {told}; set {TRACEBACK}=1 to see where, and report it\n"
        )
        return 3


def _as_typed(command: str, arguments: list[str] | None) -> str:
    """The command as it stood on the command line, to be run again."""
    given = sys.argv[1:] if arguments is None else arguments
    return shlex.join(["python", "-m", f"rigid.{command}", *given])


def _drop_output() -> None:
    """Send what standard output still holds nowhere, so that the interpreter's exit is silent."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
