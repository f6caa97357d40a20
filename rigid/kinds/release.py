"""Quick release."""

from collections.abc import Mapping
from typing import ClassVar

from rigid.kinds.base import Position, RecordKind, Solver


class Release(RecordKind):
    """A strap that preloads the rig is cut, and the plate swings out with the valve shut."""

    name: ClassVar[str] = "release"
    words: ClassVar[str] = "a quick release"
    rank: ClassVar[int] = 2
    needs: ClassVar[tuple[str, ...]] = ("acceleration",)
    one_of: ClassVar[tuple[str, ...]] = ()
    own: ClassVar[Mapping[str, str]] = {
        "preload": "{ value = 6000.0, sd = 60.0 } (N)",
        "release_time": "",
    }
    valve: ClassVar[Position | None] = "shut"
    held: ClassVar[bool] = True
    solver: ClassVar[Solver] = "release"
    must_move: ClassVar[tuple[str, ...]] = ("acceleration", "load")
    stands_out: ClassVar[tuple[str, ...]] = ("acceleration",)
    excites: ClassVar[str] = "release"
    exact: ClassVar[str] = "that the strap of a release lets go at once"
