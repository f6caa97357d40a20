"""What every kind of record has in common: what a rig is put through, and what comes of that."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Protocol, runtime_checkable

Position = Literal["open", "shut", "tank"]
Solver = Literal["slow", "release", "motion", "machine"]
Contact = Literal["frame", "ice", "free"]

SLOW_CHANNELS = ("load", "stroke", "pressure")


@runtime_checkable
class Placed(Protocol):
    """One stretch of a valve's programme."""

    @property
    def position(self) -> Position:
        """Where the valve is."""
        ...


@runtime_checkable
class Stated(Protocol):
    """A record as a spec states it, as far as a kind looks at it."""

    @property
    def channels(self) -> Mapping:
        """Its channels by quantity."""
        ...

    @property
    def valve(self) -> Sequence[Placed]:
        """Its valve's programme."""
        ...


class RecordKind:
    """One way to put a rig, or a machine, through a test; a class, of which there are no instances.

    What a kind leaves out is as for a slow record of the rig. In a spec:

    - `name`; `words`: what such a record is, for readers: "a quick release". - `rank`: by which
      kinds are listed, lowest first.
    - `takes`: channels it may have; `needs`: those it must have beside the time; `one_of`: those of
      which it must have one, where there are any.
    - `own`: keys of the record's table that are this kind's alone, each with an example of its
      value, which is empty where the key may be left out.
    - `valve`: where the valve is if a spec does not say so, None where there is none; `held`:
      whether it stays there. - `fit`: whether such a record is fitted where a spec does not say.
    - `filtered`: whether its channels go through a filter before they are explained.

    In the model:

    - `solver`: what simulates it. "slow" marches a valve's programme (and brings a flow fraction
      for each opening), "release" swings out of a preload (and brings it and the instant),
      "motion" asks which force a measured motion takes, of one body alone; "machine" marches a
      machine of the spec's own.
    - `contact`: what the plate presses on; "ice" is whatever has a load that nobody knows.

    In what is checked and told:

    - `must_move`: channels that stand still only where they are broken. - `rises`: by quantity,
      what it exceeds at some time [SI]; `travels`: how far it moves at least, if it moves [SI].
    - `stands_out`: channels that rise clearly above their noise.
    - `excites`: what moves the plunger in it, by its name in figures; empty where none is drawn.
    - `exact`: what of such a record is taken for exactly known, for readers.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    rank: ClassVar[int] = 100

    takes: ClassVar[tuple[str, ...]] = ("time", *SLOW_CHANNELS, "acceleration")
    needs: ClassVar[tuple[str, ...]] = ()
    one_of: ClassVar[tuple[str, ...]] = SLOW_CHANNELS
    own: ClassVar[Mapping[str, str]] = {}
    valve: ClassVar[Position | None] = "open"
    held: ClassVar[bool] = False
    filtered: ClassVar[bool] = False
    fit: ClassVar[bool] = True

    solver: ClassVar[Solver] = "slow"
    contact: ClassVar[Contact] = "free"

    must_move: ClassVar[tuple[str, ...]] = ()
    rises: ClassVar[Mapping[str, float]] = {}
    travels: ClassVar[Mapping[str, float]] = {}
    stands_out: ClassVar[tuple[str, ...]] = ()
    excites: ClassVar[str] = ""
    exact: ClassVar[str] = "instants of samples and of the valve"

    @classmethod
    def fault(cls, record: Stated) -> str:  # noqa: ARG003
        """Return what else is wrong with a record as it is stated, in a sentence; empty if nothing.

        What the class variables say has been looked at before.
        """
        return ""

    @classmethod
    def of_the_rig(cls) -> bool:
        """Whether it is of the rig, not of another machine."""
        return cls.solver not in ("motion", "machine")

    @classmethod
    def traits(cls) -> frozenset[str]:
        """Words by which an effect says where it acts: name, solver and contact."""
        return frozenset((cls.name, cls.solver, cls.contact))
