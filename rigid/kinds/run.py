"""Run of a machine of one's own."""

from collections.abc import Mapping
from typing import ClassVar

from rigid.kinds.base import RecordKind, Solver, Stated


class Run(RecordKind):
    """A machine that a spec puts together is driven, or left to itself, and its sensors read."""

    name: ClassVar[str] = "run"
    words: ClassVar[str] = "a run of a machine"
    rank: ClassVar[int] = 6
    takes: ClassVar[tuple[str, ...]] = (
        *("time", "load", "stroke", "pressure", "acceleration", "position"),
        *("force", "command"),
    )
    one_of: ClassVar[tuple[str, ...]] = ("load", "stroke", "pressure", "acceleration", "position")
    own: ClassVar[Mapping[str, str]] = {"start": ""}
    solver: ClassVar[Solver] = "machine"
    exact: ClassVar[str] = "instants of samples and of the valve, recorded forces and commands"

    @classmethod
    def fault(cls, record: Stated) -> str:
        """Return that a valve has both a command and a programme; empty if it has not."""
        if "command" in record.channels and any(s.position != "open" for s in record.valve):
            return (
                "valve: a command says what the valve passes; leave `valve` out, or the channel "
                "'command'"
            )
        return ""

    @classmethod
    def traits(cls) -> frozenset[str]:
        """Words by which an effect says where it acts; its valve has a programme as well."""
        return super().traits() | {"slow"}
