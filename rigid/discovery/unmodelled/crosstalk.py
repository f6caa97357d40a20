"""Sensors that answer to something else than what they are for.

A gauge before a hose reads the flow as well, a stroke sensor its own speed where it lags, a load
cell the pressure that bends its seat. Motion knows nothing of that, so that the traces need no
simulation: they are what the other sensors of the record are expected to read, and how fast that
changes.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from rigid.discovery.unmodelled.bumps import Bumps, Target, together
from rigid.localfit.local import Local
from rigid.localfit.samples import Channel

READINGS, RATES = "readings", "rates"
"""What a distortion may go by: all other quantities of the record; how fast each changes."""


def crosstalk(local: Local) -> Bumps:
    """Traces of every quantity's sensors answering to others and to rates, in all records alike."""
    layout = local.layout
    return answering(layout.channels, layout.channel, layout.time, local.reading)


def answering(
    channels: Sequence[Channel], channel: np.ndarray, time: np.ndarray, reading: np.ndarray
) -> Bumps:
    """The same from the number of each sample's channel, its time and what it should read (n,).

    Per unit of a quantity, or of its rate; `centre` is the number of that quantity in `quantities`.
    """
    rows = {(c.track, c.quantity): np.flatnonzero(channel == n) for n, c in enumerate(channels)}
    parts = [Bumps(np.zeros((len(reading), 0)), (), np.zeros(0))]
    listed = quantities(channels)
    for kind in listed:
        others = [q for q in listed if q != kind]
        for variable, sources in ((READINGS, others), (RATES, listed)):
            traces = np.zeros((len(reading), len(sources)))
            for mine, series in _beside(rows, kind):
                for i, source in enumerate(sources):
                    if source in series:
                        seen = reading[series[source]]
                        when = time[series[source]]
                        seen = seen if variable == READINGS else np.gradient(seen, when)
                        traces[mine, i] = np.interp(time[mine], when, seen)
            target = Target(kind, "sensor", variable, form="proportional")
            numbers = np.array([listed.index(q) for q in sources], dtype=float)
            parts.append(Bumps(traces, (target,) * len(sources), numbers))
    return together(parts)


def quantities(channels: Sequence[Channel]) -> tuple[str, ...]:
    """Quantities that some record has beside others, in order."""
    read: dict[str, set[str]] = {}
    for one in channels:
        read.setdefault(one.track, set()).add(one.quantity)
    return tuple(dict.fromkeys(c.quantity for c in channels if len(read[c.track]) > 1))


def _beside(
    rows: dict[tuple[str, str], np.ndarray], kind: str
) -> Iterator[tuple[np.ndarray, dict[str, np.ndarray]]]:
    """Rows of a quantity in every record, and those of all quantities of that record."""
    for (track, quantity), mine in rows.items():
        if quantity == kind:
            yield mine, {q: found for (t, q), found in rows.items() if t == track}
