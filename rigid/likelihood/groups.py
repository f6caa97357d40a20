"""Records of one kind simulated together, in one compiled program for all walkers."""

import dataclasses
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from functools import partial
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from rigid.effects import AbstractEffect
from rigid.kinds.base import Solver
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.tracks import Track
from rigid.physics.rig import Rig, acting, build_rig
from rigid.solve import full, inverse, release, slow, staggered
from rigid.solve.strap import REACH, abrupt, edges, lattice, let_go

PUMP_ANGLE = "pump_angle"
"""Angle [rad] at which the pump stood when a record began; a number of each record's own."""


class AbstractGroup(eqx.Module):
    """Tracks that share one program: same kind, same sampling, same view of the parameters.

    - `tolerance`: of the full solve by diffrax; None: exponential steps predict.
    """

    tracks: eqx.AbstractVar[tuple[Track, ...]]
    effects: eqx.AbstractVar[tuple[type[AbstractEffect], ...]]
    tolerance: eqx.AbstractVar[float | None]
    quantities: eqx.AbstractClassVar[tuple[str, ...]]

    @property
    def samples(self) -> int:
        """Samples of the grid, which is that of the longest track."""
        return max(t.size for t in self.tracks)

    @abstractmethod
    def predict(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return ideal readings by quantity, (samples, tracks, walkers), from values by label."""


class SlowGroup(AbstractGroup):
    """Frame compression, free running and field records: marched through by long steps."""

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True, default=None)
    quantities: ClassVar[tuple[str, ...]] = ("load", "stroke", "pressure")

    def predict(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return load, stroke and pressure."""
        drives = tuple(t.drive for t in self.tracks if t.drive is not None)
        seen = Scoped(values, self.tracks[0].scope)
        rig = build_rig(self.effects, seen)
        framed = self.tracks[0].of.contact == "frame"
        contact = seen["k_frame"] * (1.0 if framed else 0.0)
        fractions = self._fractions(values, contact)
        angles = self._angles(values, contact)
        if self.tolerance is not None:
            out = full.march(rig, contact, fractions, drives, angles, self.tolerance)
        elif rig.steady:
            out = slow.march(rig, contact, fractions, drives)
        else:
            out = staggered.march(rig, contact, fractions, drives, angles)
        return {quantity: series[: self.samples] for quantity, series in out.items()}

    def _angles(self, values: Mapping[str, Array], like: Array) -> Array:
        """Angles of the pump (tracks, walkers) [rad], 0 where nothing beats."""
        angles = []
        for t in self.tracks:
            shared, own = (f"{PUMP_ANGLE}[{place}]" for place in (t.name, t.label))
            angles.append(values.get(shared, values.get(own, 0.0)) + 0.0 * like)
        return jnp.stack(angles)

    def _fractions(self, values: Mapping[str, Array], like: Array) -> Array:
        """Flow fractions (levels, tracks, walkers)."""
        levels = 1 + max((max(t.open_levels, default=0) for t in self.tracks), default=0)
        rows = []
        for level in range(levels):
            rows.append(
                jnp.stack(
                    [
                        values[flow_label(t, level)] if level in t.open_levels else 0.0 * like
                        for t in self.tracks
                    ]
                )
            )
        return jnp.stack(rows)


class ReleaseGroup(AbstractGroup):
    """Quick releases: swung out step by step from the instant of release."""

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True, default=None)
    quantities: ClassVar[tuple[str, ...]] = ("acceleration",)

    def predict(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return the acceleration, 0 before the strap lets go."""
        rig = build_rig(self.effects, Scoped(values, self.tracks[0].scope))
        preload = jnp.stack([values[f"preload[{t.label}]"] for t in self.tracks])
        delay = jnp.stack([t.onset_time - values[f"release_time[{t.label}]"] for t in self.tracks])
        onsets = [t.onset for t in self.tracks if t.onset is not None]
        longest = max(t.size - o for t, o in zip(self.tracks, onsets, strict=True))
        if any(f"release_duration[{t.label}]" in values for t in self.tracks):
            return {"acceleration": self._let_go(rig, preload, delay, self._law(values, preload))}
        ring = release.ring if rig.steady else staggered.ring
        if self.tolerance is not None:
            ring = partial(full.ring, tolerance=self.tolerance)
        swing = ring(rig, preload, delay, self.tracks[0].interval, longest)
        out = jnp.zeros((self.samples, *preload.shape))
        for i, onset in enumerate(onsets):
            length = min(longest, self.samples - onset)
            out = out.at[onset : onset + length, i].set(swing[:length, i])
        return {"acceleration": out}

    def _let_go(self, rig: Rig, preload: Array, delay: Array, law: Array) -> Array:
        """Acceleration where straps take their time; they begin REACH samples after the record."""
        interval = self.tracks[0].interval
        if self.tolerance is not None:
            sampled = delay - REACH * interval, interval
            return full.let_go(rig, preload, law, sampled, self.samples, self.tolerance)
        at = lattice(delay, interval)
        ring = release.ring if rig.steady else staggered.ring
        swing = ring(rig, preload, at.delay, interval, self.samples)
        return let_go(swing, abrupt(rig, preload, interval), at, law, interval)

    def _law(self, values: Mapping[str, Array], like: Array) -> Array:
        """Instants after the release time by which shares of the preload have gone [s]."""
        laws = []
        for t in self.tracks:
            duration = values.get(f"release_duration[{t.label}]", 0.0) + 0.0 * like[0]
            shape = (values[name] + 0.0 * like[0] for name in ("release_begin", "release_end"))
            laws.append(edges(duration, *shape))
        return jnp.stack(laws, axis=1)


class MotionGroup(AbstractGroup):
    """Measured motions of one body: the force that they take."""

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True, default=None)
    quantities: ClassVar[tuple[str, ...]] = ("force",)

    def predict(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return the force; it follows from the motion, and nothing is solved."""
        seen = Scoped(values, self.tracks[0].scope)
        along = inverse.together([t.along for t in self.tracks if t.along is not None])
        return {"force": inverse.force(inverse.build_body(self.effects, seen), along)}


GROUPS: dict[Solver, type[SlowGroup | ReleaseGroup | MotionGroup]] = {
    "slow": SlowGroup,
    "release": ReleaseGroup,
    "motion": MotionGroup,
}


def beating(effects: Iterable[type[AbstractEffect]], tracks: Iterable[Track]) -> dict[str, str]:
    """Label of the pump's angle when a track began, by label of the track.

    Of those tracks that beat: one of the effects does, and the valve is open. One pump serves both
    cylinders, so that tracks of one record that begin at one instant share its angle.
    """
    kinds = [e for e in effects if e.beat is not None]
    listed = [t for t in tracks if 1 in t.open_levels and any(e.acts_in(t.kind) for e in kinds)]
    begun: dict[str, set[float]] = {}
    for t in listed:
        begun.setdefault(t.name, set()).add(round(float(t.first), 6))
    places = {t.label: t.name if len(begun[t.name]) == 1 else t.label for t in listed}
    return {label: f"{PUMP_ANGLE}[{place}]" for label, place in places.items()}


def flow_label(track: Track, level: int) -> str:
    """Label of a record's flow fraction."""
    name, places = flow_name(track, level)
    return f"{name}[{','.join(places)}]"


def flow_name(track: Track, level: int) -> tuple[str, tuple[str, ...]]:
    """Name of a flow fraction and what it belongs to: record, cylinder, stretch after the first.

    `kappa` with the valve open, `kappa_tank` to the tank.
    """
    own = (track.name, track.cylinder)
    if level == 1:
        return "kappa", own
    return "kappa_tank", own if level == 2 else (*own, str(level - 1))


@dataclasses.dataclass(frozen=True)
class Grouping:
    """How tracks fall into groups: those with the same key share a program.

    - `effects`: all there are. - `vary`: by what each parameter that varies does.
    - `only`: the kind, cylinder or "record,cylinder" that an effect is confined to, by its name.
    - `tolerance`: of the full solve, None: exponential steps.
    """

    effects: tuple[type[AbstractEffect], ...]
    vary: Mapping[str, str]
    only: Mapping[str, str] = dataclasses.field(default_factory=dict)
    tolerance: float | None = None

    def acting(self, track: Track) -> tuple[type[AbstractEffect], ...]:
        """Return the effects that act in a track."""
        return tuple(
            e
            for e in acting(self.effects, track.kind)
            if self.only.get(e.name, track.kind) in track.scope
        )

    def key(self, track: Track) -> tuple:
        """Return what a track must share with the others of its group."""
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
            kind = GROUPS[members[0].of.solver]
            size = max(t.size for t in members)
            same = tuple(t.on_grid(size) for t in members)
            groups.append(kind(same, self.acting(members[0]), self.tolerance))
        return tuple(groups)
