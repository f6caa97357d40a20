"""Gaps before and after, on fitted and on left-out records, and where an effect shows.

Leaving a record out takes no new fit: around an optimum each sample's log-likelihood is quadratic
in the parameters, so the fit without some samples is a linear system. A record's own numbers (its
flow, its preload) are integrated over when it is judged, not plugged in.
"""

import itertools
from typing import NamedTuple

import numpy as np

from rigid.likelihood.correlation import autoregression
from rigid.localfit.local import Local

BLOCKS = 8
"""Parts of a record that an effect confined to it is judged on, each left out in turn."""
MOST_OF_IT = (0.1, 0.9)


class Left(NamedTuple):
    """Judgement of left-out parts: log predictive density (units,), and the gap of all of them."""

    density: np.ndarray
    gap: float


def units(local: Local, only: str | None) -> list[np.ndarray]:
    """Rows of each part that is left out in turn: the records, or blocks of the one of `only`.

    Where there is one record alone, its blocks.
    """
    layout = local.layout
    if only is None and len(layout.tracks) == 1:
        only = layout.tracks[0]
    if only is None:
        found = [(layout.track == i) & layout.read for i in range(len(layout.tracks))]
        return [rows for rows in found if rows.any()]
    mine = (layout.track == layout.tracks.index(only)) & layout.read
    edges = np.linspace(layout.time[mine].min(), layout.time[mine].max() + 1e-9, BLOCKS + 1)
    return [mine & (layout.time >= a) & (layout.time < b) for a, b in itertools.pairwise(edges)]


def left_out(local: Local, parts: list[np.ndarray]) -> Left:
    """Judge each part by a fit to all the others.

    Source: the chain rule, log p(y_u | rest) = log Z(all) - log Z(rest), each Z by Laplace's
    method around the fit to all.
    """
    precision, pull = local.information, local.gradient
    everything = _log_integral(precision, pull, local.terms.value.sum())
    density, squares, count = [], 0.0, 0
    residual = local.residual.copy()
    for rows in parts:
        design, bend = local.design[rows], local.terms.bend[rows]
        own = design.T @ (design * bend[:, None])
        rest, without = precision - own, pull - design.T @ local.terms.score[rows]
        density.append(
            everything
            - _log_integral(rest, without, local.terms.value.sum() - local.terms.value[rows].sum())
        )
        moved = _predicted(local, rows, (rest, without))
        residual[rows] -= design @ moved
        scaled = _ahead(local, residual, rows)
        squares, count = squares + float(scaled @ scaled), count + len(scaled)
        residual[rows] = local.residual[rows]
    return Left(np.array(density), float(np.sqrt(squares / max(count, 1))))


def _log_integral(precision: np.ndarray, pull: np.ndarray, value: float) -> float:
    shift = np.linalg.solve(precision, pull)
    return float(value + 0.5 * pull @ shift - 0.5 * np.linalg.slogdet(precision)[1])


def _predicted(local: Local, rows: np.ndarray, rest: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Change of w when some rows are left out, their record's own numbers fitted to them."""
    layout = local.layout
    out = {layout.tracks[i] for i in np.unique(layout.track[rows])}
    own = local.hypothesis.own_of(out)
    moved = np.linalg.solve(*rest)
    if own.any():
        precision, pull = local.information, local.gradient
        free, held = np.flatnonzero(own), np.flatnonzero(~own)
        shared = pull[free] - precision[np.ix_(free, held)] @ moved[held]
        moved[free] = np.linalg.solve(precision[np.ix_(free, free)], shared)
    return moved


def _ahead(local: Local, residual: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Residuals of some rows one step ahead, over what the sheet allows."""
    layout, out = local.layout, []
    for number in np.unique(layout.channel[rows]):
        mine = (layout.channel == number) & rows
        scaled = residual[mine] / layout.floor[mine]
        good = layout.weight[mine] > 0
        ahead = autoregression(scaled, good).ahead(scaled, good)
        out.append(ahead[np.isfinite(ahead)])
    return np.concatenate(out) if out else np.zeros(0)


def gap(local: Local, rows: np.ndarray | None = None) -> float:
    """Root mean square of the residuals one step ahead, 1 where all is explained."""
    rows = local.layout.read if rows is None else rows
    scaled = _ahead(local, local.residual, rows)
    return float(np.sqrt(np.mean(scaled**2))) if len(scaled) else 0.0


class Place(NamedTuple):
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


def place(local: Local, gain: np.ndarray, change: np.ndarray) -> Place:
    """Find where the log-likelihood gains most.

    - `gain` (n,): of each sample. - `change` (n,): of its expected reading.
    """
    layout = local.layout
    totals = np.bincount(layout.channel, weights=gain, minlength=len(layout.channels))
    best = int(np.argmax(totals))
    channel = layout.channels[best]
    rows = np.flatnonzero((layout.channel == best) & layout.read)
    size = change[rows] ** 2 * np.maximum(local.terms.bend[rows], 0.0)
    share = np.cumsum(size) / max(float(size.sum()), 1e-300)
    end = len(rows) - 1
    first, last = (min(int(np.searchsorted(share, q)), end) for q in MOST_OF_IT)
    times = layout.time[rows]
    stretch = (float(times[first]), float(times[last]))
    line = _line(change[rows][first : last + 1], channel.interval)
    track = layout.problem.track(channel.track)
    return Place(track.name, track.cylinder, channel.quantity, stretch, line)


def _line(change: np.ndarray, interval: float) -> tuple[float, float] | None:
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
