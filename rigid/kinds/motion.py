"""Measured motion."""

from collections.abc import Mapping
from typing import ClassVar

from rigid.kinds.base import Position, RecordKind, Solver


class Motion(RecordKind):
    """One body of some machine is moved, and the force on it is measured."""

    name: ClassVar[str] = "motion"
    words: ClassVar[str] = "a measured motion"
    rank: ClassVar[int] = 5
    takes: ClassVar[tuple[str, ...]] = ("time", "position", "force", "pressure")
    needs: ClassVar[tuple[str, ...]] = ("position", "force")
    one_of: ClassVar[tuple[str, ...]] = ()
    own: ClassVar[Mapping[str, str]] = {"corner": ""}
    valve: ClassVar[Position | None] = None
    filtered: ClassVar[bool] = True
    solver: ClassVar[Solver] = "motion"
    must_move: ClassVar[tuple[str, ...]] = ("position", "force")
