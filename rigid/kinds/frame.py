"""Compression of the calibration frame."""

from collections.abc import Mapping
from typing import ClassVar

from rigid.kinds.base import Contact, RecordKind


class Frame(RecordKind):
    """The plunger presses against the calibration frame, as the valve lets it."""

    name: ClassVar[str] = "frame"
    words: ClassVar[str] = "a frame compression"
    rank: ClassVar[int] = 1
    contact: ClassVar[Contact] = "frame"
    must_move: ClassVar[tuple[str, ...]] = ("load", "pressure")
    rises: ClassVar[Mapping[str, float]] = {"load": 1e3, "pressure": 1e3}
    travels: ClassVar[Mapping[str, float]] = {"stroke": 20e-6}
    excites: ClassVar[str] = "frame"
