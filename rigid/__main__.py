"""`rigid COMMAND SPEC`: every command by its name."""

import sys
from importlib import import_module

from rigid.io.version import __version__

COMMANDS = (
    *("new", "check", "fit", "bands", "discover", "laws"),
    *("plan", "validate", "compare", "batch", "paper"),
)


def main() -> int:
    """Run the command that the command line names."""
    name, *rest = sys.argv[1:] or ["--help"]
    if name == "--version":
        sys.stdout.write(f"rigid {__version__}\n")
        return 0
    if name in ("-h", "--help"):
        lines = [f"  {one:10}{import_module(f'rigid.{one}').SAYS}" for one in COMMANDS]
        text = "\n".join(["usage: rigid COMMAND SPEC [options]", "", *lines, ""])
        sys.stdout.write(text + "\n`rigid COMMAND --help` tells the options of a command.\n")
        return 0
    if name not in COMMANDS:
        known = ", ".join(COMMANDS)
        sys.stderr.write(f"rigid: unknown command '{name}'; it is one of {known}\n")
        return 2
    return import_module(f"rigid.{name}").main(rest)


if __name__ == "__main__":
    sys.exit(main())
