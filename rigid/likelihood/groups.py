"""Records of one kind simulated together, in one compiled program for all walkers."""

import dataclasses
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects import AbstractEffect
from rigid.effects.base import Strap
from rigid.likelihood.machine import Place
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.per_record import LEAD, PUMP_ANGLE, picked
from rigid.likelihood.tracks import Track
from rigid.physics import full, inverse, release, slow, staggered
from rigid.physics.drive import Drive, Drives, side_by_side
from rigid.physics.pickup import with_lines
from rigid.physics.rig import Rig, build_rig
from rigid.physics.strap import REACH, edges, gradual, releases_of


class AbstractGroup(eqx.Module):
    """Tracks that share one program: same kind, same sampling, same view of the parameters.

    What they read is `grid.simulate(inputs(values))`: neither holds a name, so that groups of one
    shape share their programs, of one campaign or of several.

    - `tolerance`: of the full solve by diffrax; None: exponential steps predict.
    """

    tracks: eqx.AbstractVar[tuple[Track, ...]]
    effects: eqx.AbstractVar[tuple[type[AbstractEffect], ...]]
    tolerance: eqx.AbstractVar[float | None]
    quantities: eqx.AbstractClassVar[tuple[str, ...]]

    @property
    def places(self) -> tuple[Place, ...]:
        """Joints of the machine that is simulated; () for the rig of eqs. (19)-(22)."""
        return ()

    @property
    def samples(self) -> int:
        """Samples of the grid, which is that of the longest track."""
        return max(t.size for t in self.tracks)

    @property
    @abstractmethod
    def grid(self) -> "AbstractGrid":
        """What is known of the records before a fit."""

    @abstractmethod
    def inputs(
        self, values: Mapping[str, Array]
    ) -> tuple[eqx.Module | Array | dict[str, Array] | None, ...]:
        """Return what a simulation takes of the parameters: rig, then (..., walkers) each."""

    def predict(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return ideal readings by quantity, (samples, tracks, walkers), from values by label."""
        return self.own(self.grid.simulate(self.inputs(values)))

    def angles(self, values: Mapping[str, Array], like: Array) -> dict[str, list[Array]]:
        """Angles [rad] (walkers,) of lines that sensors pick up, of each track, by quantity."""
        if not any(effect.picked_up() for effect in self.effects):
            return {}
        return {
            q: [values.get(picked(q, t.label), 0.0) + 0.0 * like for t in self.tracks]
            for q in self.quantities
        }

    def coarser(self) -> "AbstractGroup":
        """Return the group in as long steps as bear what a small change does; itself by default."""
        return self

    def beginning(self, share: float) -> "AbstractGroup":  # noqa: ARG002
        """Return the group of which a share of each record, from its beginning, is simulated.

        Itself where records are simulated whole.
        """
        return self

    def own(self, found: dict[str, Array]) -> dict[str, Array]:
        """Return readings on the grid for the group's own samples and tracks."""
        return {q: s[: self.samples, : len(self.tracks)] for q, s in found.items()}


class AbstractGrid(eqx.Module):
    """What is known of a group's records before a fit, without a name."""

    @abstractmethod
    def simulate(self, inputs: tuple) -> dict[str, Array]:
        """Return ideal readings by quantity, (samples, tracks, walkers)."""


class Room(NamedTuple):
    """Tracks, flow fractions and switches of a track that a grid has room for."""

    tracks: int = 0
    levels: int = 0
    switches: int = 0


class SlowGrid(AbstractGrid):
    """Drives of slow records, marched through by long steps where the rig is steady."""

    drives: Drives
    tolerance: float | None = eqx.field(static=True)
    coarse: bool = eqx.field(static=True, default=False)

    def simulate(self, inputs: tuple) -> dict[str, Array]:
        """Return load, stroke and pressure; `inputs` as of `SlowGroup.inputs`."""
        rig, contact, fractions, angles, picked_up = inputs
        if self.tolerance is not None:
            found = full.march(rig, contact, fractions, self.drives, angles, self.tolerance)
        elif rig.steady:
            found = slow.march(rig, contact, fractions, self.drives)
        else:
            drives, coarse = self.drives, self.coarse
            found = staggered.march(rig, contact, fractions, drives, angles, coarse)
        return with_lines(rig, found, self.drives.interval, picked_up)


class SlowGroup(AbstractGroup):
    """Frame compression, free running and field records.

    - `room`: of its grid, where that is more than its own tracks take.
    """

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True, default=None)
    room: Room = eqx.field(static=True, default=Room())
    coarse: bool = eqx.field(static=True, default=False)
    quantities: ClassVar[tuple[str, ...]] = ("load", "stroke", "pressure")

    @property
    def taken(self) -> Room:
        """What the group's own tracks take."""
        levels = max((max(t.open_levels, default=0) for t in self.tracks), default=0)
        moves = max(len(d.levels) for d in self._drives) - 1
        return Room(len(self.tracks), 1 + levels, moves)

    @property
    def _drives(self) -> list[Drive]:
        return [t.drive for t in self.tracks if t.drive is not None]

    @property
    def _laid(self) -> Room:
        """Room of the grid; a full solve has no program to share, and takes none in vain."""
        return Room(*map(max, self.taken, Room() if self.tolerance else self.room))

    def _spread(self, listed: list) -> list:
        """What is listed by track, the last again where the grid has room for more."""
        return listed + listed[-1:] * (self._laid.tracks - len(listed))

    @property
    def grid(self) -> SlowGrid:
        """The drives side by side."""
        drives = side_by_side(self._spread(self._drives), self._laid.switches)
        return SlowGrid(drives, self.tolerance, self.coarse)

    def coarser(self) -> "SlowGroup":
        """Return the group in steps that are longer where the rig is not steady."""
        return dataclasses.replace(self, coarse=True)

    def inputs(
        self, values: Mapping[str, Array]
    ) -> tuple[Rig, Array, Array, Array, dict[str, Array]]:
        """Return rig, stiffness of the frame, flow fractions, angles of pump and sensors' lines."""
        seen = Scoped(values, self.tracks[0].scope)
        framed = self.tracks[0].of.contact == "frame"
        contact = seen["k_frame"] * (1.0 if framed else 0.0)
        rig = build_rig(self.effects, seen)
        lines = {q: jnp.stack(self._spread(a)) for q, a in self.angles(values, contact).items()}
        return rig, contact, self._fractions(values, contact), self._angles(values, contact), lines

    def _angles(self, values: Mapping[str, Array], like: Array) -> Array:
        """Angles of the pump (tracks, walkers) [rad], 0 where nothing beats."""
        angles = []
        for t in self.tracks:
            shared, own = (f"{PUMP_ANGLE}[{place}]" for place in (t.name, t.label))
            angles.append(values.get(shared, values.get(own, 0.0)) + 0.0 * like)
        return jnp.stack(self._spread(angles))

    def _fractions(self, values: Mapping[str, Array], like: Array) -> Array:
        """Flow fractions (levels, tracks, walkers)."""

        def of(track: Track, level: int) -> Array:
            return values[flow_label(track, level)] if level in track.open_levels else 0.0 * like

        levels = range(self._laid.levels)
        return jnp.stack(
            [jnp.stack(self._spread([of(t, level) for t in self.tracks])) for level in levels]
        )


class ReleaseGrid(AbstractGrid):
    """When releases begin.

    - `onset_times` (tracks,) [s]: of the first sample after each. - `onsets`: their numbers.
    - `sizes`: samples of each track.
    """

    onset_times: Array
    interval: float = eqx.field(static=True)
    onsets: tuple[int, ...] = eqx.field(static=True)
    sizes: tuple[int, ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True)
    coarse: bool = eqx.field(static=True, default=False)

    def simulate(self, inputs: tuple) -> dict[str, Array]:
        """Return the acceleration, 0 before the release; `inputs` as of `ReleaseGroup.inputs`."""
        rig, preload, instant, law, picked_up = inputs
        delay = self.onset_times[:, None] - instant
        swing = self._sudden if law is None else partial(self._gradual, law=law)
        found = {"acceleration": swing(rig, preload, delay)}
        return with_lines(rig, found, self.interval, picked_up)

    def _ring(self, rig: Rig, among: int = 1) -> Callable[..., Array]:
        """How a rig swings out, by steps; `among`: how many intervals make a sample."""
        if rig.steady:
            return release.ring
        return partial(staggered.ring, coarse=self.coarse, among=among)

    def _sudden(self, rig: Rig, preload: Array, delay: Array) -> Array:
        """Acceleration where straps let go at once."""
        longest = max(size - o for size, o in zip(self.sizes, self.onsets, strict=True))
        ring = self._ring(rig)
        if self.tolerance is not None:
            ring = partial(full.ring, tolerance=self.tolerance)
        swing = ring(rig, preload, delay, self.interval, longest)
        samples = max(self.sizes)
        out = jnp.zeros((samples, *preload.shape))
        for i, onset in enumerate(self.onsets):
            length = min(longest, samples - onset)
            out = out.at[onset : onset + length, i].set(swing[:length, i])
        return out

    def _gradual(self, rig: Rig, preload: Array, delay: Array, law: Array) -> Array:
        """Acceleration where straps take their time; records begin REACH samples before the onset.

        - `law`: as `rigid.physics.strap.edges` gives it.
        """
        samples = max(self.sizes)
        if self.tolerance is not None:
            sampled = delay - REACH * self.interval, self.interval
            return full.let_go(rig, preload, law, sampled, samples, self.tolerance)
        ring = self._ring(rig, releases_of(rig))
        return gradual(ring, rig, preload, law, (delay, self.interval), samples)


class ReleaseGroup(AbstractGroup):
    """Quick releases: swung out step by step from the instant of release."""

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True, default=None)
    coarse: bool = eqx.field(static=True, default=False)
    quantities: ClassVar[tuple[str, ...]] = ("acceleration",)

    @property
    def grid(self) -> ReleaseGrid:
        """When the releases begin."""
        onsets = tuple(t.onset for t in self.tracks if t.onset is not None)
        return ReleaseGrid(
            jnp.stack([t.onset_time for t in self.tracks]),
            self.tracks[0].interval,
            onsets,
            tuple(t.size for t in self.tracks),
            self.tolerance,
            self.coarse,
        )

    def coarser(self) -> "ReleaseGroup":
        """Return the group in steps that are longer where the rig is not steady."""
        return dataclasses.replace(self, coarse=True)

    def inputs(
        self, values: Mapping[str, Array]
    ) -> tuple[Rig, Array, Array, Array | None, dict[str, Array]]:
        """Return rig, preloads, instants of release, how straps let go (None: at once), angles."""
        rig = build_rig(self.effects, Scoped(values, self.tracks[0].scope))
        preload = jnp.stack([values[f"preload[{t.label}]"] for t in self.tracks])
        instant = jnp.stack([values[f"release_time[{t.label}]"] for t in self.tracks])
        lines = {q: jnp.stack(a) for q, a in self.angles(values, preload[0]).items()}
        return rig, preload, instant, self._law(rig.strap(), values, preload), lines

    def _law(self, strap: Strap | None, values: Mapping[str, Array], like: Array) -> Array | None:
        """Instants after the release time by which shares of the preload have gone [s]."""
        if strap is None:
            return None
        law = edges(*(number + 0.0 * like[0] for number in strap))
        return jnp.stack([law - values[f"{LEAD}[{t.label}]"] for t in self.tracks], axis=1)


class MotionGrid(AbstractGrid):
    """Measured motions side by side."""

    along: inverse.Along

    def simulate(self, inputs: tuple) -> dict[str, Array]:
        """Return the force; it follows from the motion, and nothing is solved."""
        return {"force": inverse.force(inputs[0], self.along)}


class MotionGroup(AbstractGroup):
    """Measured motions of one body: the force that they take."""

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True, default=None)
    quantities: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def grid(self) -> MotionGrid:
        """The motions side by side."""
        return MotionGrid(inverse.together([t.along for t in self.tracks if t.along is not None]))

    def inputs(self, values: Mapping[str, Array]) -> tuple[inverse.Body]:
        """Return the body."""
        return (inverse.build_body(self.effects, Scoped(values, self.tracks[0].scope)),)


def predictions(
    groups: Sequence[AbstractGroup], values: Sequence[Mapping[str, Array]]
) -> list[dict[str, Array]]:
    """Ideal readings of every group, by quantity, (samples, tracks, walkers).

    - `values`: by label, of each group.

    Groups of one shape take turns in one program: side by side, each would be compiled anew.
    """
    asked = [(one.grid, one.inputs(given)) for one, given in zip(groups, values, strict=True)]
    found: dict[int, dict[str, Array]] = {}
    for members in _alike(asked):
        if len(members) == 1:
            grid, inputs = asked[members[0]]
            found[members[0]] = grid.simulate(inputs)
            continue
        turns = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(asked[i] for i in members))
        read = jax.lax.map(lambda turn: turn[0].simulate(turn[1]), turns)
        for place, i in enumerate(members):
            found[i] = {q: series[place] for q, series in read.items()}
    return [group.own(found[i]) for i, group in enumerate(groups)]


def _alike(asked: Sequence[tuple]) -> list[list[int]]:
    """Numbers of those that share their shape, together."""
    alike: dict[tuple, list[int]] = {}
    for i, one in enumerate(asked):
        leaves, form = jax.tree.flatten(one)
        shapes = tuple((jnp.shape(leaf), jnp.result_type(leaf)) for leaf in leaves)
        alike.setdefault((form, shapes), []).append(i)
    return list(alike.values())


def flow_label(track: Track, level: int) -> str:
    """Label of a record's flow fraction."""
    name, places = flow_name(track, level)
    return f"{name}[{','.join(places)}]"


def flow_name(track: Track, level: int) -> tuple[str, tuple[str, ...]]:
    """Name of a flow fraction and what it belongs to: record, cylinder, stretch after the first.

    `kappa` with the valve open, `kappa_tank` to the tank. Where a command was recorded the fraction
    is that of the joint, the same in every run.
    """
    if track.given is not None and track.given.command is not None:
        return "kappa", (track.cylinder,)
    own = (track.name, track.cylinder)
    if level == 1:
        return "kappa", own
    return "kappa_tank", own if level == 2 else (*own, str(level - 1))
