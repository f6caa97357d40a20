"""How many facts a sample is, judged once what physics can explain has been taken out.

Residuals that resemble their neighbours count less (`rigid.likelihood.correlation`). But a missing
effect makes neighbours alike, too; taken for correlated noise, it would hide itself. So the
correlation is that of what is left after the signatures of all effects and hidden forces have been
fitted (`rigid.localfit.leftover`). Single samples that stand far off both neighbours are no physics
of a rig, nor are those of a sensor at the end of its range: they do not count at all.
"""

import numpy as np

from rigid.localfit.leftover import Explaining, noise_laws
from rigid.localfit.local import Local
from rigid.localfit.samples import data_of
from rigid.records.checks import SATURATED_RUN
from rigid.records.defects import runs

SPIKE = 6.0
"""Sds of noise and rounding that a sample must stand off the median of its neighbourhood."""
NEIGHBOURS = 5
ABOVE = 2.0
"""Sds by which the fit must lie above each of SATURATED_RUN equal greatest readings in a row."""


def spikes(local: Local) -> np.ndarray:
    """Where a sample stands off its neighbours (n,).

    Spikes are in the noise level that they are compared with; so they are looked for again with
    the level of what is left, until none are found.
    """
    sensor, read = local.layout.sensor, local.layout.read
    off, (sd, _) = _off(local), _sds(local)
    found = np.zeros(len(sd), dtype=bool)
    while True:
        level = np.ones(len(local.layout.problem.sensors))
        for number in range(len(level)):
            mine = read & (sensor == number)
            if (mine & found).any():
                left = local.residual[mine & ~found]
                level[number] = np.sqrt(np.mean(left**2) / np.mean(local.residual[mine] ** 2))
        again = off > SPIKE * level[sensor] * sd
        if not np.any(again & ~found):
            return found
        found |= again


def _off(local: Local) -> np.ndarray:
    """How far each sample lies off the median of its neighbourhood (n,)."""
    layout, half = local.layout, NEIGHBOURS // 2
    off = np.zeros(len(local.residual))
    for number in range(len(layout.channels)):
        rows = np.flatnonzero((layout.channel == number) & layout.read)
        if len(rows) < NEIGHBOURS:
            continue
        series = np.pad(local.residual[rows], half, mode="edge")
        near = np.lib.stride_tricks.sliding_window_view(series, NEIGHBOURS)
        off[rows] = np.abs(local.residual[rows] - np.median(near, axis=1))
    return off


def beyond(local: Local) -> np.ndarray:
    """Where the fit lies beyond the end of a sensor's range (n,).

    A sensor that stands still at its greatest reading, while the fit is above it throughout, has
    come to an end there. What it reads where the fit is that high says nothing, whichever way its
    noise fell.
    """
    layout, read = local.layout, data_of(local.layout)
    sd, step = _sds(local)
    found = np.zeros(len(read), dtype=bool)
    for sensor in range(len(layout.problem.sensors)):
        mine = (layout.sensor == sensor) & layout.read
        if not mine.any():
            continue
        end = float(read[mine].max()) - 0.5 * step[mine].max()
        stuck = mine & (read >= end) & (local.residual < -ABOVE * sd)
        for number in np.unique(layout.channel[stuck]):
            rows = np.flatnonzero((layout.channel == number) & layout.read)
            firsts, lasts = runs(stuck[rows])
            if np.any(lasts - firsts + 1 >= SATURATED_RUN):
                found |= mine & (read - local.residual > end)
    return found


def _sds(local: Local) -> tuple[np.ndarray, np.ndarray]:
    """Sd of noise and rounding of every sample (n,), and the step of its converter (n,)."""
    layout = local.layout
    sigma = local.hypothesis.sigmas(local.z_noise)[layout.sensor]
    steps = np.array([p.sheet.step for p in layout.problem.pieces for _ in p.tracks])
    step = steps[layout.channel]
    return np.sqrt(sigma**2 + step**2 / 12.0), step


def facts(local: Local, traces: np.ndarray) -> np.ndarray:
    """Weight of each sample (n,): 0 for spikes and beyond a range, else one over correlation times.

    - `local`: fitted with weight 1 wherever something was read. - `traces` (n, k).
    """
    layout = local.layout
    good = layout.read & ~spikes(local) & ~beyond(local)
    weight = np.where(good, 1.0, 0.0)
    rows = [layout.channel == number for number in range(len(layout.channels))]
    explaining = Explaining.by(local, traces)
    for mine, law in zip(rows, noise_laws(explaining, rows, good), strict=True):
        weight[mine] /= law.time
    return weight
