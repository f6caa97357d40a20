"""Where an effect shows: in which channel, over which stretch, at which frequency."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.localfit.local import LocalFit

MOST_OF_IT = (0.1, 0.9)
"""Shares of what an effect changes between which its stretch lies."""


class Where(NamedTuple):
    """Where an effect shows: record, channel, stretch [s], line [Hz] where there is one."""

    record: str
    cylinder: str
    channel: str
    time_s: tuple[float, float] | None
    frequency_Hz: tuple[float, float] | None

    @property
    def track(self) -> str:
        """Label of the record, "record,cylinder"."""
        return f"{self.record},{self.cylinder}"


def where_shown(
    local: LocalFit, gain: Float[np.ndarray, " n"], change: Float[np.ndarray, " n"]
) -> Where:
    """Find where the log-likelihood gains most.

    - `gain` (n,): of each sample. - `change` (n,): of its expected reading.
    """
    layout = local.layout
    totals = np.bincount(layout.channel, weights=gain, minlength=len(layout.channels))
    best = int(np.argmax(totals))
    channel = layout.channels[best]
    rows = np.flatnonzero((layout.channel == best) & layout.read)
    size = change[rows] ** 2 * np.maximum(local.terms.curvature[rows], 0.0)
    share = np.cumsum(size) / max(float(size.sum()), 1e-300)
    end = len(rows) - 1
    first, last = (min(int(np.searchsorted(share, q)), end) for q in MOST_OF_IT)
    times = layout.time[rows]
    stretch = (float(times[first]), float(times[last]))
    line = _line(change[rows][first : last + 1], channel.interval)
    track = layout.problem.track(channel.track)
    return Where(track.name, track.cylinder, channel.quantity, stretch, line)


def _line(change: Float[np.ndarray, " n"], interval: float) -> tuple[float, float] | None:
    """Band of a line that holds most of a change, or None where there is none."""
    if len(change) < 32:
        return None
    trend = np.polynomial.Polynomial.fit(np.arange(len(change)), change, 2)
    power = np.abs(np.fft.rfft(change - trend(np.arange(len(change))))) ** 2
    frequency = np.fft.rfftfreq(len(change), interval)
    top = int(np.argmax(power))
    near = slice(max(top - 2, 1), top + 3)
    if top < 4 or power[near].sum() < 0.6 * power[1:].sum():
        return None
    return float(frequency[near][0]), float(frequency[near][-1])
