"""Free running."""

from collections.abc import Mapping
from typing import ClassVar

from rigid.kinds.base import RecordKind


class FreeRun(RecordKind):
    """The plunger runs out with nothing in its way."""

    name: ClassVar[str] = "free-run"
    words: ClassVar[str] = "a free run"
    rank: ClassVar[int] = 3
    must_move: ClassVar[tuple[str, ...]] = ("stroke",)
    travels: ClassVar[Mapping[str, float]] = {"stroke": 1e-3}
    excites: ClassVar[str] = "free run"
