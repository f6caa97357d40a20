"""The kinds of failure a command can end with, and how a message repeats what was found."""

from collections.abc import Callable, Sequence
from typing import Any


class RigidError(Exception):
    """Base of all failures that are reported in a sentence instead of a traceback."""

    status = 3


LONGEST = 60
"""Letters of a value that a message repeats, at most."""
MOST_NAMES = 40
"""Names that a message lists, at most."""


def quoted(found: object) -> str:
    """Return a value as a message repeats it: in Python's form, cut where it is long."""
    try:
        whole = repr(found)
    except ValueError:  # a whole number of thousands of digits
        return "a number of thousands of digits"
    if len(whole) <= LONGEST:
        return whole
    return f"{whole[:LONGEST]}... ({len(whole)} letters)"


def listed(names: Sequence[object]) -> str:
    """Return names as a message lists them: quoted, some of them where there are many."""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(map(quoted, names[:MOST_NAMES])) + more


class InputError(RigidError):
    """The input is at fault; the message says where, what was found and what to do."""

    status = 2


def together(*steps: Callable[[], Any]) -> list[Any]:
    """Return what each step returns; all are tried before any is given up.

    Raises InputError with the problems of all of them, one a line.
    """
    found, problems = [], []
    for step in steps:
        try:
            found.append(step())
        except InputError as error:
            problems += str(error).splitlines()
    if problems:
        raise InputError("\n".join(dict.fromkeys(problems)))
    return found


class UnusableResultError(RigidError):
    """The command ran, but its result must not be used as it stands."""

    status = 1


class EnvironmentFaultError(RigidError):
    """Something outside the input stopped the run: a full disk, a folder in use, lost workers."""

    status = 3
