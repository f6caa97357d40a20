"""Field test."""

from typing import ClassVar

from rigid.kinds.base import Contact, RecordKind


class Field(RecordKind):
    """The rig presses on ice, whose load is unknown; bands are made for it."""

    name: ClassVar[str] = "field"
    words: ClassVar[str] = "a field test"
    rank: ClassVar[int] = 4
    one_of: ClassVar[tuple[str, ...]] = ()
    fit: ClassVar[bool] = False
    contact: ClassVar[Contact] = "ice"
    exact: ClassVar[str] = "instants of samples"
