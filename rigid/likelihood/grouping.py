"""How records fall into groups that are simulated together, and groups into one shape."""

import dataclasses
from collections.abc import Mapping, Sequence

from rigid.effects import AbstractEffect
from rigid.effects.placed import those_at
from rigid.kinds.base import Solver
from rigid.likelihood.groups import AbstractGroup, MotionGroup, ReleaseGroup, Room, SlowGroup
from rigid.likelihood.machine import Layout
from rigid.likelihood.machine_group import MachineGroup, machine_group
from rigid.likelihood.tracks import Track
from rigid.physics.rig import acting

SHORT = 0.5
"""Slow records of less than this share of the longest keep a grid of their own."""

OF_A_TURN = 1.0
"""What a turn costs beside the tracks in it, in tracks: its step matrices."""

GROUPS: dict[Solver, type[SlowGroup | ReleaseGroup | MotionGroup]] = {
    "slow": SlowGroup,
    "release": ReleaseGroup,
    "motion": MotionGroup,
}
"""By solver; runs of a machine need to know the machine, see `Grouping`."""


def explained(solver: Solver) -> tuple[str, ...]:
    """Return the quantities that a solver predicts."""
    return MachineGroup.quantities if solver == "machine" else GROUPS[solver].quantities


@dataclasses.dataclass(frozen=True)
class Grouping:
    """How tracks fall into groups: those with the same key share a program.

    - `effects`: all there are. - `vary`: by what each parameter that varies does.
    - `only`: the kind, cylinder or "record,cylinder" that an effect is confined to, by its name.
    - `tolerance`: of the full solve, None: steps. - `layout`: of the machine whose runs these are.
    """

    effects: tuple[type[AbstractEffect], ...]
    vary: Mapping[str, str]
    only: Mapping[str, str] = dataclasses.field(default_factory=dict)
    tolerance: float | None = None
    layout: Layout | None = None

    def acting(self, track: Track) -> tuple[type[AbstractEffect], ...]:
        """Return the effects that act in a track; of a machine those at its joint."""
        if track.of.solver == "machine":
            return those_at(self.effects, track.cylinder)
        return tuple(
            e
            for e in acting(self.effects, track.kind)
            if self.only.get(e.name, track.kind) in track.scope
        )

    def key(self, track: Track) -> tuple:
        """Return what a track must share with the others of its group; joints move together."""
        if track.of.solver == "machine":
            return track.kind, round(track.interval, 9)
        by = set(self.vary.values())
        scope: dict[str, str] = dict(zip(("kind", "cylinder", "record"), track.scope, strict=True))
        names = tuple(e.name for e in self.acting(track))
        return track.kind, round(track.interval, 9), names, *(scope[b] for b in sorted(by))

    def __call__(self, tracks: tuple[Track, ...]) -> tuple[AbstractGroup, ...]:
        """Part the tracks into groups."""
        keys = sorted({self.key(t) for t in tracks}, key=repr)
        groups = []
        for key in keys:
            members = tuple(t for t in tracks if self.key(t) == key)
            size = max(t.size for t in members)
            same = tuple(t.on_grid(size) for t in members)
            groups.append(self._group(same))
        return in_turns(groups)

    def _group(self, tracks: tuple[Track, ...]) -> AbstractGroup:
        if self.layout is not None:
            return machine_group(tracks, self.effects, self.tolerance, self.layout)
        kind = GROUPS[tracks[0].of.solver]
        return kind(tracks, self.acting(tracks[0]), self.tolerance)


def in_turns(groups: Sequence[AbstractGroup]) -> tuple[AbstractGroup, ...]:
    """Cut groups of slow records to one shape, so that they take turns in one program.

    Compiling is what a first run waits for, and each further kind of record took a third of it.
    """
    slow = [group for group in groups if isinstance(group, SlowGroup)]
    alike: dict[tuple, list[SlowGroup]] = {}
    for group in slow:
        shared = group.tracks[0].interval, group.effects
        longest = max(g.samples for g in slow if shared == (g.tracks[0].interval, g.effects))
        alike.setdefault((*shared, group.samples < SHORT * longest), []).append(group)
    cut = {id(group): parts for members in alike.values() for group, parts in _cut(members)}
    return tuple(part for group in groups for part in cut.get(id(group), [group]))


def _cut(groups: Sequence[SlowGroup]) -> list[tuple[SlowGroup, list[SlowGroup]]]:
    """Each group, and the parts of one shape that it is cut into."""
    counts = [len(group.tracks) for group in groups]

    def cost(width: int) -> float:
        return sum(-(-count // width) for count in counts) * (width + OF_A_TURN)

    width = min(range(max(counts), 0, -1), key=cost)
    size = max(group.samples for group in groups)
    room = Room(width, *map(max, zip(*(group.taken[1:] for group in groups), strict=True)))
    return [
        (
            group,
            [
                SlowGroup(
                    tuple(t.on_grid(size) for t in group.tracks[i : i + width]),
                    group.effects,
                    group.tolerance,
                    room,
                )
                for i in range(0, len(group.tracks), width)
            ],
        )
        for group in groups
    ]
