"""What runs of a machine need beside its parts: fed joints, where they start, how fine to march."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import jax.numpy as jnp
import numpy as np

from rigid.effects import AbstractEffect
from rigid.effects.placed import those_at
from rigid.io.errors import InputError
from rigid.likelihood.machine import Coordinate, Layout
from rigid.likelihood.machine_group import P_START, V_START, X_START
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.tracks import Series, Track
from rigid.physics.machine_run import steps_a_sample

WHERE = ("stroke", "position")
"""Channels that tell how far a machine moves."""

DRAWS, RESOLVED = 32, 0.75
"""Machines drawn from the priors, and the share of them whose swings are resolved."""

LAG = 5
"""Samples over which a speed is told from them."""


@dataclasses.dataclass(frozen=True)
class Start:
    """A number of where a run starts that is in motion: name, coordinate or joint, usual size."""

    name: str
    run: str
    at: str
    symbol: str
    unit: str
    size: float


def fed(tracks: Sequence[Track], effects: Sequence[type[AbstractEffect]]) -> tuple[Track, ...]:
    """Return the tracks, without a valve at joints of a machine that no pump feeds."""
    return tuple(
        dataclasses.replace(t, drive=None)
        if t.given is not None
        and not any(e.equation == "pump" for e in those_at(effects, t.cylinder))
        else t
        for t in tracks
    )


def starts(
    layout: Layout, tracks: Sequence[Track], series: Mapping[str, Series]
) -> Iterator[Start]:
    """Yield where runs start that are in motion when they begin.

    Raises InputError where no sensor tells how far that may be.
    """
    moving = dict.fromkeys(t.name for t in tracks if t.given is not None and t.given.moving)
    for run in moving:
        here = [series[t.label] for t in tracks if t.name == run]
        moved = [s.data[q][s.weight[q] > 0] for s in here for q in WHERE if s.has(q)]
        if not moved:
            raise InputError(
                f"record '{run}' starts in motion, and neither a stroke nor a position tells how "
                "far; let it start from rest, or add such a channel"
            )
        interval = next(t.interval for t in tracks if t.name == run)
        far = max(float(np.abs(one).max()) for one in moved)
        fast = max(float(np.abs(one[LAG:] - one[:-LAG]).max()) for one in moved) / LAG / interval
        for one in layout.coordinates:
            lever = _lever(layout, one)
            unit = "rad" if one.axis else "m"
            yield Start(X_START, run, one.name, "x_0", unit, far / lever)
            yield Start(V_START, run, one.name, "v_0", f"{unit}/s", fast / lever)
        pressed = [s.data["pressure"] for s in here if s.has("pressure")]
        if not pressed and any(place.oil for place in layout.places):
            raise InputError(
                f"record '{run}' starts in motion, and no pressure tells what the oil is under; "
                "let it start from rest, or add the channel"
            )
        for place in (p.name for p in layout.places if p.oil):
            size = max(float(np.abs(one).max()) for one in pressed)
            yield Start(P_START, run, place, "p_0", "Pa", size)


def _lever(layout: Layout, one: Coordinate) -> float:
    """By how much the farthest end of a joint moves for a coordinate."""
    place = layout.coordinates.index(one)
    ends = [end[place] for p in layout.places for end in (p.behind, p.ahead)]
    return max(map(abs, ends), default=0.0) or 1.0


def resolved(
    layout: Layout,
    effects: Sequence[type[AbstractEffect]],
    parameters: Parameters,
    tracks: Sequence[Track],
) -> Layout:
    """Return the layout with so many steps a sample that the machine's swings are resolved.

    They are those of machines drawn from the priors, three in four of which are resolved: friction
    may quench a swing in the middle of its prior and let it ring beside that.
    """
    drawn = np.random.default_rng(0).standard_normal((DRAWS, parameters.size))
    lasting = {(t.interval, t.interval * int(t.samples)) for t in tracks}
    taken = []
    for z in drawn:
        machine = layout.build(effects, parameters.values(jnp.asarray(z[None])))
        taken.append(max(steps_a_sample(machine, *one) for one in lasting))
    return dataclasses.replace(layout, steps=int(np.quantile(taken, RESOLVED)))
