"""Traces of bumps: what hidden forces and flows and distortions of a sensor would leave."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rigid.kinds import kinds_with
from rigid.localfit.families import Family
from rigid.localfit.hidden_inputs import BY_KIND
from rigid.localfit.local import Local
from rigid.localfit.samples import Layout
from rigid.localfit.signature import Way, changes, reads, rows_of

SLOW_BUMPS, RELEASE_BUMPS, STATE_BUMPS = 10, 10, 6
KINDS = "kind of record"
"""What a constant that is none goes by."""
RELEASE_SPAN = 0.05
"""Seconds after a release in which a hidden force is looked for: half of what rings."""


class Target(NamedTuple):
    """What a bundle of bumps acts on.

    - `kind`: "force", "drag", "flow", "spring", the quantity whose sensor is distorted, or the
      label of a constant that differs between KINDS.
    - `equation`. - `variable`: what the bumps follow. - `track`: one record's alone, or None.
    - `period` [m]: of a wave, which has a cosine and a sine in place of bumps.
    - `log_share`: log of the share of its prior that it stands for, where it is the best of so many
      `tried`. - `form`: of what is straight over its variable; "" for bumps.
    """

    kind: str
    equation: str
    variable: str
    track: str | None = None
    period: float | None = None
    log_share: float = 0.0
    tried: int = 1
    form: str = ""

    @property
    def sort(self) -> str:
        """Sort of hidden thing; each has the same share of what one would bet on hidden things."""
        if self.variable == KINDS:
            return "shift"
        if self.form:
            return "straight"
        return "time" if self.variable == "time" else "curve"


class Bumps(NamedTuple):
    """Traces of bumps: `columns` (n, m), `target` and place of the centre of each."""

    columns: np.ndarray
    target: tuple[Target, ...]
    centre: np.ndarray


class Job(NamedTuple):
    """A bundle of bumps of a hidden force, flow or spring, to be simulated.

    - `target`. - `label`: of the height. - `centre` (m,); `width`. - `kinds`: of records in which
      it shows. - `tracks`: each of which has the bumps to itself; (): all together.
    """

    target: Target
    label: str
    centre: np.ndarray
    width: float
    kinds: frozenset[str]
    tracks: tuple[str, ...] = ()


def bumps(local: Local, steady: Family) -> Bumps:
    """Traces of hidden forces and flows and of distortions of every sensor.

    - `steady`: the program that holds the hidden effects.
    """
    jobs = [*_over_time(local), *_over_states(local)]
    return together([*_simulated(local, steady, jobs), *_of_sensors(local)])


def together(parts: Sequence[Bumps]) -> Bumps:
    """Put traces side by side."""
    return Bumps(
        np.concatenate([p.columns for p in parts], axis=1),
        tuple(t for p in parts for t in p.target),
        np.concatenate([p.centre for p in parts]),
    )


def _simulated(local: Local, steady: Family, jobs: list[Job]) -> Iterator[Bumps]:
    """Slopes by the height of every bump."""
    ways = []
    for job in jobs:
        name = job.label.split("[")[0]
        for centre in job.centre:
            shape = ((f"{name}_centre", float(centre)), (f"{name}_width", job.width))
            ways.append(Way(job.label, (*shape, (job.label, 0.0)), None, job.kinds))
    slopes = changes(local, steady, ways) * reads(local)[:, None]
    layout, at = local.layout, 0
    for job in jobs:
        mine = slopes[:, at : at + len(job.centre)]
        at += len(job.centre)
        for track in job.tracks or (None,):
            target = job.target._replace(track=track)
            own = mine if track is None else np.where(rows_of(layout, track)[:, None], mine, 0.0)
            yield Bumps(own, (target,) * len(job.centre), job.centre)


def _over_time(local: Local) -> Iterator[Job]:
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
        kinds = frozenset(spans[t][0] for t in tracks)
        for kind in ("force", "drag", "flow"):
            if here := kinds & _acting(layout, kind):
                target = Target(kind, BY_KIND[kind].equation, "time")
                yield Job(target, f"hidden_{kind}[1]", centres, span / count, here, tracks)


def _over_states(local: Local) -> Iterator[Job]:
    """Bumps over states of the rig, the same in all records."""
    layout = local.layout

    def range_of(quantity: str) -> tuple[float, float]:
        numbers = [i for i, c in enumerate(layout.channels) if c.quantity == quantity]
        rows = np.isin(layout.channel, numbers) & layout.read
        found = local.reading[rows]
        return (float(found.min()), float(found.max())) if rows.any() else (0.0, 0.0)

    ranges = (
        ("pressure", range_of("pressure")),
        ("stroke", range_of("stroke")),
        ("speed", _speeds(local)),
    )
    jobs = [
        (kind, variable, 2 + number, bounds)
        for kind in ("force", "flow")
        for number, (variable, bounds) in enumerate(ranges)
    ]
    swing = _swing(local)
    jobs.append(("drag", "cylinder speed", 2, (-swing, swing)))
    low, high = range_of("load")
    stiffness = local.hypothesis.values(local.w).get("k_LC", (6e7, 0.0))[0]
    jobs.append(("spring", "load", 2, (-high / stiffness, -low / stiffness)))
    for kind, variable, number, (low, high) in jobs:
        here = _acting(layout, kind)
        if high > low and here:
            width = (high - low) / (STATE_BUMPS - 1)
            centres = low + width * np.arange(STATE_BUMPS)
            target = Target(kind, BY_KIND[kind].equation, variable)
            yield Job(target, f"hidden_{kind}[{number}]", centres, width, here)


def _acting(layout: Layout, kind: str) -> frozenset[str]:
    """Kinds of records in which a hidden thing acts."""
    return frozenset(k for k in layout.kinds if BY_KIND[kind].acts_in(k))


def _speeds(local: Local) -> tuple[float, float]:
    """Least and greatest speed of the plunger in the slow records [m/s], from their strokes."""
    low = high = 0.0
    for number, channel in enumerate(local.layout.channels):
        if channel.quantity == "stroke":
            stroke = local.reading[local.layout.channel == number]
            every = max(round(0.1 / channel.interval), 1)
            speed = np.diff(stroke[::every]) / (every * channel.interval)
            low, high = min(low, float(speed.min())), max(high, float(speed.max()))
    return low, high


def _swing(local: Local) -> float:
    """How fast things move in a release [m/s]: the greatest integral of its acceleration."""
    swings = [
        float(np.ptp(np.cumsum(local.reading[local.layout.channel == number]) * channel.interval))
        for number, channel in enumerate(local.layout.channels)
        if channel.quantity == "acceleration"
    ]
    return 0.5 * max(swings, default=0.0)


def _of_sensors(local: Local) -> list[Bumps]:
    """Distortions of the sensors: over time in each record, and over their own reading in all."""
    layout, out = local.layout, []
    for number, channel in enumerate(layout.channels):
        rows = (layout.channel == number) & layout.read
        span = (float(layout.time[rows].min()), float(layout.time[rows].max()))
        target = Target(channel.quantity, "sensor", "time", channel.track)
        out.append(_bumped(layout.time, rows, span, SLOW_BUMPS, target))
    for sensor, name in enumerate(layout.problem.sensors):
        rows = (layout.sensor == sensor) & layout.read
        span = (float(local.reading[rows].min()), float(local.reading[rows].max()))
        target = Target(name.split(",")[0], "sensor", "reading", None)
        out.append(_bumped(local.reading, rows, span, STATE_BUMPS, target))
    return out


def _bumped(
    values: np.ndarray, rows: np.ndarray, span: tuple[float, float], count: int, target: Target
) -> Bumps:
    """Bumps of a reading over some values, in some rows."""
    width = max((span[1] - span[0]) / (count - 1), 1e-12)
    centres = span[0] + width * np.arange(count)
    height = np.maximum(0.0, 1.0 - np.abs(values[:, None] - centres) / width)
    return Bumps(np.where(rows[:, None], height, 0.0), (target,) * count, centres)
