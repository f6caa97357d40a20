"""What each candidate, and each bump of a hidden force, would leave in the records.

Simulations are differentiable: the change of every sample with a small amplitude of an effect is
one forward derivative at the amplitude where it is absent, many of them in one program.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from rigid.discovery.candidates import Candidate
from rigid.discovery.families import Family, holding, sweep
from rigid.discovery.hidden import BY_KIND
from rigid.discovery.local import Local
from rigid.discovery.samples import Layout, split_swept

SLOW_BUMPS, RELEASE_BUMPS, STATE_BUMPS = 10, 10, 6
RELEASE_SPAN = 0.05
"""Seconds after a release in which a hidden force is looked for: half of what rings."""


class Target(NamedTuple):
    """What a bundle of bumps acts on.

    - `kind`: "force", "drag", "flow", "spring", or the quantity whose sensor is distorted.
    - `equation`. - `variable`: what the bumps follow. - `track`: one record's alone, or None.
    """

    kind: str
    equation: str
    variable: str
    track: str | None = None


class Bumps(NamedTuple):
    """Traces of bumps: `columns` (n, m), `target` and place of the centre of each."""

    columns: np.ndarray
    target: tuple[Target, ...]
    centre: np.ndarray


def lanes_of(local: Local, more: Mapping[str, np.ndarray], count: int) -> dict[str, np.ndarray]:
    """Values of all parameters in `count` equal lanes, with those of `more` in their place."""
    hypothesis = local.hypothesis
    values = {k: np.full(count, v) for k, v in hypothesis.constants().items()}
    values |= {k: np.full(count, v) for k, (v, _) in hypothesis.values(local.w).items()}
    return values | dict(more)


def reads(local: Local) -> np.ndarray:
    """1 + gain of each sample's sensor (n,)."""
    gains = local.hypothesis.sensors(local.w)[:, 0] * local.layout.spreads[:, 0]
    return 1.0 + gains[local.layout.sensor]


class Way(NamedTuple):
    """One simulation: the slope by an amplitude, or the change up to a level of it.

    - `amplitude`: its label. - `shape`: values of the effect's parameters. - `level`: None: the
      slope. - `kinds`: of records in which it shows.
    """

    amplitude: str
    shape: tuple[tuple[str, float], ...]
    level: float | None
    kinds: frozenset[str]


def traces(local: Local, found: tuple[Family, ...], listed: Iterable[Candidate]) -> np.ndarray:
    """Change of every sample's expected reading per unit amplitude, (n, candidates)."""
    listed = tuple(listed)
    columns: list[np.ndarray | None] = [None] * len(listed)
    lots: dict[int, list[int]] = {}
    for i, one in enumerate(listed):
        lots.setdefault(found.index(holding(found, [one.effect])), []).append(i)
    for number, members in lots.items():
        # Candidates that differ by their record alone share a simulation.
        ways = list(dict.fromkeys(_way(local.layout, listed[i]) for i in members))
        changes = _changes(local, found[number], ways)
        for i in members:
            column = changes[:, ways.index(_way(local.layout, listed[i]))]
            columns[i] = _confined(local.layout, column, listed[i].only)
    return np.stack([c for c in columns if c is not None], axis=1) * reads(local)[:, None]


def _way(layout: Layout, one: Candidate) -> Way:
    kinds = frozenset(k for k in layout.kinds if one.effect.acts_in(k))
    return Way(one.amplitude, tuple(one.shape.items()), one.level, kinds)


def _confined(layout: Layout, column: np.ndarray, only: str | None) -> np.ndarray:
    return column if only is None else np.where(_rows(layout, only), column, 0.0)


def _rows(layout: Layout, track: str) -> np.ndarray:
    """Which samples are a record's (n,)."""
    return layout.track == layout.tracks.index(track)


def _changes(local: Local, family: Family, ways: list[Way]) -> np.ndarray:
    """Change of every sample by each way, (n, ways), all in as few turns as there can be."""
    far = [i for i, way in enumerate(ways) if way.level is not None]
    kinds = frozenset(k for i in far for k in ways[i].kinds)
    still = [Way("", ways[far[0]].shape, None, kinds)] if far else []  # what levels change from
    lanes = [*ways, *still]
    quiet, count = family.quiet, len(lanes)
    labels = dict.fromkeys(label for way in lanes for label, _ in way.shape)
    more = {k: np.full(count, quiet[k]) for k in labels}
    along = {way.amplitude: np.zeros(count) for way in ways}
    for i, way in enumerate(lanes):
        for label, value in way.shape:
            more[label][i] = value
        if way.level is not None:
            more[way.amplitude][i] += way.level
        elif way.amplitude:
            along[way.amplitude][i] = 1.0
    acts = {k: np.array([k in way.kinds for way in lanes]) for k in local.layout.kinds}
    swept = sweep(family, lanes_of(local, more, count), along, acts)
    readings, slopes = split_swept(local.layout, swept)
    out = slopes[:, : len(ways)]
    for i in far:
        out[:, i] = np.where(
            local.layout.of_kinds(ways[i].kinds), readings[:, i] - readings[:, -1], 0.0
        )
    return out


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
    parts = [*_simulated(local, steady, jobs), *_of_sensors(local)]
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
    slopes = _changes(local, steady, ways) * reads(local)[:, None]
    layout, at = local.layout, 0
    for job in jobs:
        mine = slopes[:, at : at + len(job.centre)]
        at += len(job.centre)
        for track in job.tracks or (None,):
            target = job.target._replace(track=track)
            own = mine if track is None else np.where(_rows(layout, track)[:, None], mine, 0.0)
            yield Bumps(own, (target,) * len(job.centre), job.centre)


def _over_time(local: Local) -> Iterator[Job]:
    """Bumps over the time of each record."""
    layout = local.layout
    spans = {}
    for channel in layout.channels:
        rows = layout.read & (layout.track == layout.tracks.index(channel.track))
        span = float(np.ptp(layout.time[rows])) if rows.any() else 0.0
        spans[channel.track] = (channel.kind, span)
    for release, count in ((False, SLOW_BUMPS), (True, RELEASE_BUMPS)):
        tracks = tuple(t for t, (kind, _) in spans.items() if (kind == "release") == release)
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
