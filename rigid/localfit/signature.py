"""What each candidate would leave in the records: the change of every sample with its amplitude.

Simulations are differentiable: that change is one forward derivative at the amplitude where an
effect is absent, many of them in one program. Where a rig is not steady a derivative takes five
times as long as a simulation, and a small difference takes its place.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from rigid.localfit.candidates import Candidate
from rigid.localfit.families import Family, holding, read, sweep
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout, flat_readings, split_swept

SMALL = 1e-5
"""Share of an amplitude's prior up to which records are compared in place of a derivative, where
that costs much."""


def lanes_of(local: LocalFit, more: Mapping[str, np.ndarray], count: int) -> dict[str, np.ndarray]:
    """Values of all parameters in `count` equal lanes, with those of `more` in their place."""
    values = local.hypothesis.every(local.w)
    return {label: np.full(count, value) for label, value in values.items()} | dict(more)


def reads(local: LocalFit) -> np.ndarray:
    """1 + gain of each sample's sensor (n,)."""
    gains = local.hypothesis.sensors(local.w)[:, 0] * local.layout.spreads[:, 0]
    return 1.0 + gains[local.layout.sensor]


class Way(NamedTuple):
    """One simulation: the derivative by an amplitude, or the change up to a level of it.

    - `amplitude`: its label. - `shape`: values of the effect's parameters. - `level`: None: the
      derivative. - `kinds`: of records in which it shows. - `unit`: what the change is divided by.
    """

    amplitude: str
    shape: tuple[tuple[str, float], ...]
    level: float | None
    kinds: frozenset[str]
    unit: float = 1.0


def signatures(
    local: LocalFit, found: tuple[Family, ...], listed: Iterable[Candidate]
) -> np.ndarray:
    """Change of every sample's expected reading per unit amplitude, (n, candidates)."""
    listed = tuple(listed)
    if not listed:
        return np.zeros((len(local.layout.channel), 0))
    columns: list[np.ndarray | None] = [None] * len(listed)
    lots: dict[int, list[int]] = {}
    for i, one in enumerate(listed):
        lots.setdefault(found.index(holding(found, [one.effect])), []).append(i)
    for number, members in lots.items():
        # Candidates that differ by their record alone share a simulation.
        mine = [_way(local.layout, listed[i], found[number]) for i in members]
        ways = list(dict.fromkeys(mine))
        moved = changes(local, found[number], ways)
        for i, way in zip(members, mine, strict=True):
            column = moved[:, ways.index(way)]
            columns[i] = _confined(local.layout, column, listed[i].only)
    return np.stack([c for c in columns if c is not None], axis=1) * reads(local)[:, None]


def _way(layout: Layout, one: Candidate, family: Family) -> Way:
    """How a candidate's signature is simulated by a program that has its effect."""
    kinds = frozenset(k for k in layout.kinds if one.effect.acts_in(k))
    turn = [(family.turns[one.effect], 1.0)] if one.effect in family.turns else []
    shape = (*one.shape.items(), *turn)
    if family.steady or one.level is not None:
        return Way(one.amplitude, shape, one.level, kinds)
    departures = [float(one.prior.from_standard(z)) - one.absent for z in (1.0, -1.0)]
    small = SMALL * max(departures, key=abs)  # either may be 0, where a prior is not centred
    return Way(one.amplitude, shape, small, kinds, small)


def _confined(layout: Layout, column: np.ndarray, only: str | None) -> np.ndarray:
    return column if only is None else np.where(rows_of(layout, only), column, 0.0)


def rows_of(layout: Layout, track: str) -> np.ndarray:
    """Which samples are a record's (n,)."""
    return layout.track == layout.tracks.index(track)


def changes(local: LocalFit, family: Family, ways: list[Way]) -> np.ndarray:
    """Change of every sample by each way, (n, ways), all in as few turns as there can be."""
    out = np.zeros((len(local.layout.channel), len(ways)))
    far = [i for i, way in enumerate(ways) if way.level is not None]
    near = [i for i, way in enumerate(ways) if way.level is None]
    if far:
        out[:, far] = _differences(local, family, [ways[i] for i in far])
    if near:
        out[:, near] = _derivatives(local, family, [ways[i] for i in near])
    # What cannot be simulated around this fit has no signature to look for.
    out[:, ~np.isfinite(out).all(axis=0)] = 0.0
    return out


def _differences(local: LocalFit, family: Family, ways: list[Way]) -> np.ndarray:
    """Change of every sample up to the level of each way, over its unit (n, ways)."""
    kinds = frozenset(k for way in ways for k in way.kinds)
    starts = [_absent(way, family.quiet) for way in ways]
    bases = list(dict.fromkeys(starts))  # what others change from
    lanes = [*ways, *(Way("", base, None, kinds) for base in bases)]
    values, acts = _lanes(local, family, lanes)
    for i, way in enumerate(ways):
        values[way.amplitude][i] += way.level
    reading = flat_readings(local.layout, read(family, values, acts))
    out = np.zeros((len(reading), len(ways)))
    for i, way in enumerate(ways):
        rows = local.layout.of_kinds(way.kinds)
        base = len(ways) + bases.index(starts[i])
        out[rows, i] = (reading[rows, i] - reading[rows, base]) / way.unit
    return out


def _absent(way: Way, quiet: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    """What a way has in place of what is there where no effect is: an amplitude a hair beside."""
    return tuple(
        (label, value)
        for label, value in way.shape
        if label == way.amplitude and value != quiet[label]
    )


def _derivatives(local: LocalFit, family: Family, ways: list[Way]) -> np.ndarray:
    """Slope of every sample by the amplitude of each way (n, ways)."""
    values, acts = _lanes(local, family, ways)
    along = {way.amplitude: np.zeros(len(ways)) for way in ways}
    for i, way in enumerate(ways):
        along[way.amplitude][i] = 1.0
    return split_swept(local.layout, sweep(family, values, along, acts))[1]


def _lanes(
    local: LocalFit, family: Family, ways: list[Way]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Values of all parameters by label, the ways' shapes in them, and where each way acts."""
    more = {
        label: np.full(len(ways), family.quiet[label]) for way in ways for label, _ in way.shape
    }
    for i, way in enumerate(ways):
        for label, value in way.shape:
            more[label][i] = value
    acts = {k: np.array([k in way.kinds for way in ways]) for k in local.layout.kinds}
    return lanes_of(local, more, len(ways)), acts
