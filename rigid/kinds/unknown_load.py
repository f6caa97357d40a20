"""Test of a machine of one's own."""

from typing import ClassVar

from rigid.kinds.base import Contact
from rigid.kinds.run import Run


class MachineTest(Run):
    """A machine that a spec puts together works on what is unknown; bands are made for it."""

    name: ClassVar[str] = "test"
    words: ClassVar[str] = "a test of a machine"
    rank: ClassVar[int] = 7
    own: ClassVar[dict[str, str]] = {}
    fit: ClassVar[bool] = False
    contact: ClassVar[Contact] = "ice"
    exact: ClassVar[str] = "instants of samples, recorded forces and commands"
