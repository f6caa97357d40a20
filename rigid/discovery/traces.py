"""What each candidate, and each bump of a hidden force, would leave in the records.

Simulations are differentiable: the change of every sample with a small amplitude of an effect is
one forward derivative at the amplitude where it is absent, many of them in one program.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from rigid.discovery.candidates import Candidate
from rigid.discovery.families import Family, holding, sweep
from rigid.discovery.hidden import VARIABLES
from rigid.discovery.local import Local
from rigid.discovery.samples import Layout, split_swept

SLOW_BUMPS, RELEASE_BUMPS, STATE_BUMPS = 10, 10, 6
RELEASE_SPAN = 0.05
"""Seconds after a release in which a hidden force is looked for: half of what rings."""


class Target(NamedTuple):
    """What a bundle of bumps acts on.

    - `kind`: "force", "flow", "spring", or the quantity whose sensor is distorted.
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


def traces(local: Local, found: tuple[Family, ...], listed: Iterable[Candidate]) -> np.ndarray:
    """Change of every sample's expected reading per unit amplitude, (n, candidates)."""
    listed = tuple(listed)
    columns: list[np.ndarray | None] = [None] * len(listed)
    lots: dict[int, list[int]] = {}
    for i, one in enumerate(listed):
        lots.setdefault(found.index(holding(found, [one.effect])), []).append(i)
    for number, members in lots.items():
        ways = list(dict.fromkeys(_way(listed[i]) for i in members))
        slopes = _changes(local, found[number], ways)
        for i in members:
            column = slopes[:, ways.index(_way(listed[i]))]
            columns[i] = _confined(local.layout, column, listed[i].only)
    return np.stack([c for c in columns if c is not None], axis=1) * reads(local)[:, None]


def _way(one: Candidate) -> tuple:
    """What one simulation serves: candidates that differ by their record alone share it."""
    return one.amplitude, tuple(one.shape.items()), one.level


def _confined(layout: Layout, column: np.ndarray, only: str | None) -> np.ndarray:
    if only is None:
        return column
    return np.where(layout.track == layout.tracks.index(only), column, 0.0)


def _changes(local: Local, family: Family, ways: list[tuple]) -> np.ndarray:
    """Change of every sample by each way, (n, ways): slopes, and differences up to a level."""
    out = np.empty((len(local.reading), len(ways)))
    steep = [i for i, way in enumerate(ways) if way[2] is None]
    far = [i for i, way in enumerate(ways) if way[2] is not None]
    if steep:
        shapes = [dict(ways[i][1]) for i in steep]
        out[:, steep] = _slopes(local, family, shapes, [ways[i] for i in steep])
    if far:
        shapes = [dict(ways[i][1]) for i in far]
        moved = [
            {**s, ways[i][0]: s[ways[i][0]] + ways[i][2]} for s, i in zip(shapes, far, strict=True)
        ]
        readings = _readings(local, family, [shapes[0], *moved])
        out[:, far] = readings[:, 1:] - readings[:, :1]
    return out


def _readings(local: Local, family: Family, shapes: list[dict]) -> np.ndarray:
    """Ideal readings with the effects at some shapes, (n, shapes)."""
    labels = dict.fromkeys(label for shape in shapes for label in shape)
    more = {k: np.array([s.get(k, family.quiet[k]) for s in shapes]) for k in labels}
    values = lanes_of(local, more, len(shapes))
    return split_swept(local.layout, sweep(family, values, {}))[0]


def _slopes(local: Local, family: Family, shapes: list[dict], ways: list[tuple]) -> np.ndarray:
    """Derivatives by the amplitude named first in each way, at its shape, (n, ways)."""
    labels = dict.fromkeys(label for shape in shapes for label in shape)
    quiet = family.quiet
    more = {k: np.array([shape.get(k, quiet[k]) for shape in shapes]) for k in labels}
    along = {
        k: np.array([1.0 if way[0] == k else 0.0 for way in ways])
        for k in dict.fromkeys(way[0] for way in ways)
    }
    values = lanes_of(local, more, len(ways))
    return split_swept(local.layout, sweep(family, values, along))[1]


def bumps(local: Local, steady: Family) -> Bumps:
    """Traces of hidden forces and flows and of distortions of every sensor.

    - `steady`: the program that holds the hidden effects.
    """
    parts = [*_over_time(local, steady), *_over_states(local, steady), *_of_sensors(local)]
    return Bumps(
        np.concatenate([p.columns for p in parts], axis=1),
        tuple(t for p in parts for t in p.target),
        np.concatenate([p.centre for p in parts]),
    )


def _heights(local: Local, steady: Family, jobs: list[tuple[str, float, float]]) -> np.ndarray:
    """Slopes (n, jobs) by the height of bumps: label of the height, centre, width."""
    shapes, ways = [], []
    for label, centre, width in jobs:
        name = label.split("[")[0]
        shapes.append({f"{name}_centre": centre, f"{name}_width": width, label: 0.0})
        ways.append((label,))
    return _slopes(local, steady, shapes, ways) * reads(local)[:, None]


def _over_time(local: Local, steady: Family) -> list[Bumps]:
    layout = local.layout
    spans = {}
    for channel in layout.channels:
        rows = layout.read & (layout.track == layout.tracks.index(channel.track))
        span = float(np.ptp(layout.time[rows])) if rows.any() else 0.0
        spans[channel.track] = (channel.kind, span)
    kinds = {"force": "plunger-momentum", "flow": "oil-balance"}
    out = []
    for release, count in ((False, SLOW_BUMPS), (True, RELEASE_BUMPS)):
        tracks = [t for t, (kind, _) in spans.items() if (kind == "release") == release]
        if not tracks:
            continue
        span = RELEASE_SPAN if release else max(spans[t][1] for t in tracks)
        centres = (np.arange(count) + 0.5) * span / count
        for kind, equation in kinds.items():
            jobs = [(f"hidden_{kind}[1]", c, span / count) for c in centres]
            slopes = _heights(local, steady, jobs)
            for track in tracks:
                mine = np.where((layout.track == layout.tracks.index(track))[:, None], slopes, 0.0)
                out.append(Bumps(mine, (Target(kind, equation, "time", track),) * count, centres))
    return out


def _over_states(local: Local, steady: Family) -> list[Bumps]:
    """Bumps over pressure, stroke and speed, the same in all records; the load-cell end by load."""
    layout, out = local.layout, []

    def range_of(quantity: str) -> tuple[float, float]:
        numbers = [i for i, c in enumerate(layout.channels) if c.quantity == quantity]
        rows = np.isin(layout.channel, numbers) & layout.read
        found = local.reading[rows]
        return (float(found.min()), float(found.max())) if rows.any() else (0.0, 0.0)

    speed = _speeds(local)
    ranges = {"pressure": range_of("pressure"), "stroke": range_of("stroke"), "speed": speed}
    jobs = [
        (kind, equation, variable, f"hidden_{kind}[{1 + VARIABLES.index(variable)}]", bounds)
        for kind, equation in (("force", "plunger-momentum"), ("flow", "oil-balance"))
        for variable, bounds in ranges.items()
    ]
    low, high = range_of("load")
    stiffness = local.hypothesis.values(local.w).get("k_LC", (6e7, 0.0))[0]
    squeezed = (-high / stiffness, -low / stiffness)
    jobs.append(("spring", "load-cell", "load", "hidden_spring[2]", squeezed))
    for kind, equation, variable, label, (low, high) in jobs:
        if high <= low:
            continue
        width = (high - low) / (STATE_BUMPS - 1)
        centres = low + width * np.arange(STATE_BUMPS)
        slopes = _heights(local, steady, [(label, c, width) for c in centres])
        out.append(Bumps(slopes, (Target(kind, equation, variable),) * STATE_BUMPS, centres))
    return out


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
