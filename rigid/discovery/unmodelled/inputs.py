"""Hidden forces and flows: bumps over the time of each record, or over a state in all of them."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, AbstractHidden, Bumps, Curve, together
from rigid.discovery.unmodelled.joints import Span, paths_at_joints
from rigid.kinds import kinds_with
from rigid.localfit.hidden_inputs import (
    CYLINDER_SPEED,
    LOAD,
    PRESSURE,
    SPEED,
    STROKE,
    TIME,
    AbstractHiddenInput,
    Followed,
    HiddenDrag,
    HiddenFlow,
    HiddenForce,
    HiddenSpring,
    at_joint,
    at_joints,
)
from rigid.localfit.local import LocalFit
from rigid.localfit.motions import Course, courses
from rigid.localfit.samples import Layout
from rigid.localfit.signature import Way, changes, reads

SLOW_BUMPS, RELEASE_BUMPS, STATE_BUMPS = 10, 10, 6
RELEASE_SPAN = 0.05
"""Seconds after a release in which a hidden force is looked for: half of what rings."""
EFFECTS: Mapping[str, type[AbstractHiddenInput]] = {
    "force": HiddenForce,
    "flow": HiddenFlow,
    "drag": HiddenDrag,
    "spring": HiddenSpring,
}
OVER_TIME = ("force", "drag", "flow")


@dataclasses.dataclass(frozen=True)
class Input(Curve):
    """A hidden force or flow.

    - `kind`: one of EFFECTS. - `track`: of a machine, a run. - `place`: its joint; "" for the rig.
    - `brief`: just after a release alone, not all along its record.
    """

    place: str = ""
    brief: bool = False

    sort: ClassVar[str] = "input"
    order: ClassVar[int] = 1

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:  # noqa: ARG003
        """Bumps of all forces and flows."""
        local = fit.local
        if local.layout.problem.places:
            return together(list(_simulated(fit, list(_at_joints(local)))))
        return together(list(_simulated(fit, [*_over_time(local), *_over_states(local)])))

    @property
    def effect(self) -> type[AbstractHiddenInput]:
        """The effect that simulates it."""
        return at_joint(EFFECTS[self.kind], self.place)

    @property
    def over(self) -> Followed:
        """What it follows."""
        return next(one for one in self.effect.followed if one.name == self.variable)

    @property
    def about(self) -> About:
        """What its effect says."""
        effect, at = self.effect, self.place
        name = f"{effect.at_a_joint} at {at}" if at else effect.phrase
        return About(effect.equation, name, effect.parameters()[0].unit, self.over)

    @property
    def timed(self) -> bool:
        """Over the time of one record, all along it."""
        return super().timed and not self.brief

    @property
    def pooled(self) -> AbstractHidden | None:
        """The same over the time of all records, releases among them."""
        return None if self.track is None else dataclasses.replace(self, track=None, brief=False)

    @property
    def forms(self) -> tuple[str, ...]:
        """Over a state; only what turns has a sign."""
        if self.over is TIME:
            return ()
        return ("constant", "proportional", *(("sign",) if self.over.turns else ()))


class BumpRequest(NamedTuple):
    """A bundle of bumps, to be simulated.

    - `target`. - `centre` (m,); `width`. - `kinds`: of records in which it shows. - `tracks`: each
      of which has the bumps to itself; (): all together.
    """

    target: Input
    centre: Float[np.ndarray, " m"]
    width: float
    kinds: frozenset[str]
    tracks: tuple[str, ...] = ()

    def ways(self) -> Iterator[Way]:
        """How each bump is simulated."""
        heights, centre, width = (info.labels for info in self.target.effect.parameters())
        height = heights[self.target.effect.followed.index(self.target.over)]
        for at in self.centre:
            shape = ((centre[0], float(at)), (width[0], self.width), (height, 0.0))
            yield Way(height, shape, None, self.kinds)


def _simulated(fit: Fitted, jobs: list[BumpRequest]) -> Iterator[Bumps]:
    """Slopes by the height of every bump."""
    local, at = fit.local, 0
    family = fit.program(dict.fromkeys(job.target.effect for job in jobs))
    slopes = changes(local, family, [way for job in jobs for way in job.ways()])
    slopes = slopes * reads(local)[:, None]
    for job in jobs:
        mine = slopes[:, at : at + len(job.centre)]
        at += len(job.centre)
        for track in job.tracks or (None,):
            target = dataclasses.replace(job.target, track=track)
            rows = None if track is None else _rows_of(local.layout, track)[:, None]
            own = mine if rows is None else np.where(rows, mine, 0.0)
            yield Bumps(own, (target,) * len(job.centre), job.centre)


def _rows_of(layout: Layout, track: str) -> np.ndarray:
    """Which samples are a record's, or of all joints of a machine's run (n,)."""
    mine = [i for i, one in enumerate(layout.tracks) if track in (one, one.rpartition(",")[0])]
    return np.isin(layout.track, mine)


def _at_joints(local: LocalFit) -> Iterator[BumpRequest]:
    """Bumps at the joints of a machine: over the time of each run, and over states in all."""
    names = {effect: kind for kind, effect in EFFECTS.items()}
    paths = paths_at_joints(local)
    lasts = max(path.lasts for path in paths.values())
    for effect, joint, followed in at_joints(local.layout.problem):
        kind, path = names[effect], paths[joint]
        here = _acting(at_joint(effect, joint), local.layout.kinds)
        if kind in OVER_TIME and TIME in followed:
            centres = (np.arange(SLOW_BUMPS) + 0.5) * lasts / SLOW_BUMPS
            target = Input(kind, TIME.name, place=joint)
            yield BumpRequest(target, centres, lasts / SLOW_BUMPS, here, path.runs)
        for state in followed:
            yield from _along(Input(kind, state.name, place=joint), path.spans.get(state), here)


def _along(target: Input, span: Span | None, kinds: frozenset[str]) -> Iterator[BumpRequest]:
    """Bumps from one end of a state's span to the other; none where it does not change."""
    low, high = span or (0.0, 0.0)
    if high > low and kinds:
        width = (high - low) / (STATE_BUMPS - 1)
        yield BumpRequest(target, low + width * np.arange(STATE_BUMPS), width, kinds)


def _over_time(local: LocalFit) -> Iterator[BumpRequest]:
    """Bumps over the time of each record."""
    layout = local.layout
    spans, released = {}, kinds_with("release")
    for channel in layout.channels:
        rows = layout.read & (layout.track == layout.tracks.index(channel.track))
        span = float(np.ptp(layout.time[rows])) if rows.any() else 0.0
        spans[channel.track] = (channel.kind, span)
    for release, count in ((False, SLOW_BUMPS), (True, RELEASE_BUMPS)):
        tracks = tuple(t for t, (kind, _) in spans.items() if (kind in released) == release)
        if not tracks:
            continue
        span = RELEASE_SPAN if release else max(spans[t][1] for t in tracks)
        centres = (np.arange(count) + 0.5) * span / count
        kinds = {spans[t][0] for t in tracks}
        for kind in OVER_TIME:
            if here := _acting(EFFECTS[kind], kinds):
                target = Input(kind, TIME.name, brief=release)
                yield BumpRequest(target, centres, span / count, here, tracks)


def _over_states(local: LocalFit) -> Iterator[BumpRequest]:
    """Bumps over states of the rig, the same in all records."""
    spans = {state: span(local) for state, span in SPANS.items()}
    for kind, effect in EFFECTS.items():
        here = _acting(effect, local.layout.kinds)
        for state in effect.followed:
            yield from _along(Input(kind, state.name), spans.get(state), here)


def _acting(effect: type[AbstractHiddenInput], kinds: Iterable[str]) -> frozenset[str]:
    """Those kinds of records in which a hidden thing acts."""
    return frozenset(kind for kind in kinds if effect.acts_in(kind))


def _range_of(local: LocalFit, quantity: str) -> Span:
    """Least and greatest expected reading of a quantity; 0 and 0 where it is not read."""
    layout = local.layout
    numbers = [i for i, c in enumerate(layout.channels) if c.quantity == quantity]
    return _span(local.reading[np.isin(layout.channel, numbers) & layout.read])


def _span(values: Float[np.ndarray, " m"]) -> Span:
    """Least and greatest of some values; 0 and 0 where there are none."""
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)


def _with_motions(local: LocalFit, simulated: Span, of: Callable[[Course], np.ndarray]) -> Span:
    """From where to where a state goes in records that are simulated and in measured motions."""
    measured = [_span(of(one)) for one in courses(local.layout.problem)]
    spans = [span for span in (simulated, *measured) if span != (0.0, 0.0)]
    return min((s[0] for s in spans), default=0.0), max((s[1] for s in spans), default=0.0)


def _speeds(local: LocalFit) -> Span:
    """Least and greatest speed of the plunger in the slow records [m/s], from their strokes."""
    low = high = 0.0
    for number, channel in enumerate(local.layout.channels):
        if channel.quantity == "stroke":
            stroke = local.reading[local.layout.channel == number]
            every = max(round(0.1 / channel.interval), 1)
            speed = np.diff(stroke[::every]) / (every * channel.interval)
            low, high = min(low, float(speed.min())), max(high, float(speed.max()))
    return low, high


def _swing(local: LocalFit) -> Span:
    """How fast things move in a release [m/s]: the greatest integral of its acceleration."""
    swings = [
        float(np.ptp(np.cumsum(local.reading[local.layout.channel == number]) * channel.interval))
        for number, channel in enumerate(local.layout.channels)
        if channel.quantity == "acceleration"
    ]
    swing = 0.5 * max(swings, default=0.0)
    return -swing, swing


def _compression(local: LocalFit) -> Span:
    """Least and greatest displacement of the cylinder [m] under the loads that are read."""
    low, high = _range_of(local, "load")
    stiffness = local.hypothesis.values(local.w).get("k_LC", (6e7, 0.0))[0]
    return -high / stiffness, -low / stiffness


SPANS: Mapping[Followed, Callable[[LocalFit], Span]] = {
    PRESSURE: lambda local: _with_motions(
        local, _range_of(local, "pressure"), lambda one: one.pressure
    ),
    STROKE: lambda local: _with_motions(
        local, _range_of(local, "stroke"), lambda one: one.position
    ),
    SPEED: lambda local: _with_motions(local, _speeds(local), lambda one: one.speed),
    CYLINDER_SPEED: _swing,
    LOAD: _compression,
}
"""From where to where each state goes."""
