"""Numbers that effects bring in record by record: angles of what beats, leads of straps."""

from collections.abc import Iterable
from typing import NamedTuple

from rigid.effects import AbstractEffect
from rigid.kinds.base import SLOW_CHANNELS
from rigid.likelihood.tracks import Track

PUMP_ANGLE = "pump_angle"
"""Angle [rad] at which the pump stood when a record began; a number of each record's own."""
PICKUP_ANGLE = "pickup_angle"
"""Angle [rad] of a line when a record began; with the quantity behind it, a number of each
channel's own."""
LEAD = "release_lead"
"""By how much [s] a strap that takes its time begins earlier than its release."""
READ = {"slow": SLOW_CHANNELS, "release": ("acceleration",)}
"""Channels in which sensors pick something up, by what solves a record."""


class Channel(NamedTuple):
    """A channel of a record: label of the track, quantity."""

    track: str
    quantity: str


def beating(effects: Iterable[type[AbstractEffect]], tracks: Iterable[Track]) -> dict[str, str]:
    """Label of the pump's angle when a track began, by label of the track.

    Of those tracks that beat: one of the effects does, and the valve is open. One pump serves both
    cylinders, so that tracks of one record that begin at one instant share its angle.
    """
    kinds = [e for e in effects if e.beat is not None and not e.picked_up()]
    listed = [t for t in tracks if 1 in t.open_levels and any(e.acts_in(t.kind) for e in kinds)]
    begun: dict[str, set[float]] = {}
    for t in listed:
        begun.setdefault(t.name, set()).add(round(float(t.first), 6))
    places = {t.label: t.name if len(begun[t.name]) == 1 else t.label for t in listed}
    return {label: f"{PUMP_ANGLE}[{place}]" for label, place in places.items()}


def picking_up(
    effects: Iterable[type[AbstractEffect]], tracks: Iterable[Track]
) -> dict[Channel, str]:
    """Label of the angle of a line in each channel, of those tracks whose sensors pick one up."""
    kinds = [e for e in effects if e.picked_up()]
    return {
        Channel(t.label, quantity): picked(quantity, t.label)
        for t in tracks
        if any(e.acts_in(t.kind) for e in kinds)
        for quantity in READ.get(t.of.solver, ())
    }


def picked(quantity: str, track: str) -> str:
    """Label of the angle of a line in a channel of a track."""
    return f"{PICKUP_ANGLE}_{quantity}[{track}]"


def letting_go(effects: Iterable[type[AbstractEffect]], tracks: Iterable[Track]) -> dict[str, str]:
    """Label of how early the strap begins, by label of the track, of releases that are gradual."""
    gradual = any(effect.gradual() for effect in effects)
    return {t.label: f"{LEAD}[{t.label}]" for t in tracks if gradual and t.onset is not None}


def of_all(effects: Iterable[type[AbstractEffect]], tracks: Iterable[Track]) -> list[str]:
    """Labels of all such numbers of some effects."""
    kinds, listed = tuple(effects), tuple(tracks)
    found = (each(kinds, listed) for each in (beating, picking_up, letting_go))
    return list(dict.fromkeys(label for one in found for label in one.values()))
