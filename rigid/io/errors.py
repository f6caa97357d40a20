"""The kinds of failure a command can end with, each with its exit status."""


class RigidError(Exception):
    """Base of all failures that are reported in a sentence instead of a traceback."""

    status = 3


class InputError(RigidError):
    """The input is at fault; the message says where, what was found and what to do."""

    status = 2


class UnusableResultError(RigidError):
    """The command ran, but its result must not be used as it stands."""

    status = 1


class EnvironmentFaultError(RigidError):
    """Something outside the input stopped the run: a full disk, a folder in use, lost workers."""

    status = 3
