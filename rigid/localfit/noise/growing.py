"""Noise that grows with what is read: a constant part, and one in proportion to the reading.

The variance of a sample is s^2 (1 + (g y)^2), the two-component model (Rocke and Lorenzato 1995,
Technometrics 37, 176-184). Where it is taken for even, samples of large readings count too much:
they are as far off as a missing effect would leave them.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from rigid.likelihood.correlation import noise_law
from rigid.likelihood.set_aside import Readings
from rigid.localfit.noise.tails import (
    GAUSS,
    Counted,
    Law,
    likeliest,
    student_law,
    unexplained,
)
from rigid.localfit.samples import Layout

TRIED = np.concatenate([[0.0], np.geomspace(0.2, 8.0, 24)])
"""Parts in proportion that are tried: at the greatest reading of a quantity, in constant parts."""
LAWS = (GAUSS, *map(student_law, (3.0, 4.0, 6.0, 12.0)))
"""Laws of noise that are tried beside them: some samples far off, where large readings happen to
be, are heavy tails. The Gaussian alone tells first whether there is anything to look at."""
FINENESS = 8
"""Scales that are tried, to a factor of two."""
LOGS = np.arange(-3 * FINENESS, int(4.1 * FINENESS) + 1) / FINENESS
"""Logarithms, to the base of two, of all scales that noise may have, in sds of the fit's."""
EVEN = LOGS[LOGS <= 1.0]
"""Those of the constant part."""
CLASSES = 10
"""Of readings that are taken together."""
FEW = 0.1
"""Share of a channel's samples that have to be beyond half of its greatest reading: what is large
just after a release alone is as loud there by anything that acts then."""


class Left(NamedTuple):
    """What nothing explains of a channel's samples, in the fit's noise.

    - `residual`, `score` (m,). - `share` (m,): readings by the greatest of the quantity. - `step`:
      of the converter.
    """

    residual: np.ndarray
    score: np.ndarray
    share: np.ndarray
    step: float


def by_growth(
    layout: Layout,
    readings: Readings,
    reading: Float[np.ndarray, " n"],
    residual: Float[np.ndarray, " n"],
    score: Float[np.ndarray, " n"],
    good: Bool[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Variance of each sample's noise over that of its sensor (n,); 1 where it does not grow.

    - `readings`: the samples of the layout. - `reading` (n,): ideal. - `residual`, `score` (n,):
      what nothing explains of the fit's. - `good` (n,): what counts.

    One over these variances is 1 in the mean over a sensor's samples that count: they count as many
    facts as before.
    """
    out = np.ones(len(residual))
    channels = unexplained(layout, readings, residual, good)
    for quantity in dict.fromkeys(one.quantity for one in channels):
        numbers = [i for i, one in enumerate(layout.channels) if one.quantity == quantity]
        mine = np.isin(layout.channel, numbers)
        share = np.abs(reading) / max(float(np.abs(reading[mine]).max()), 1e-300)
        records = [
            Left(one.residual, score[one.rows], share[one.rows], one.step)
            for one in channels
            if one.quantity == quantity
        ]
        if growth := growth_of(records):
            variance = _variance(share, growth)
            for sensor in np.unique(layout.sensor[mine & good]):
                some = mine & (layout.sensor == sensor)
                out[some] = variance[some] * np.mean(1.0 / variance[some & good])
    return out


def growth_of(records: Sequence[Left]) -> float:
    """How noise of a quantity grows, as in TRIED; 0 where it does not.

    - `records`: the channel of each.

    How noise grows is a matter of a quantity's sensors: with any one record left out it has to grow
    still. Channels that are not white are not asked, for what is missing leaves more where more is
    read, too, and neighbours that resemble each other; nor are those of few large readings.
    """
    asked = [one for one in records if _large(one.share)]
    return _growth_of(asked, LAWS) if _growth_of(asked, LAWS[:1]) else 0.0


def _growth_of(records: Sequence[Left], laws: Sequence[Law]) -> float:
    each = [(one, _heights(one, laws)) for one in records]
    white = [(one, heights) for one, heights in each if _white(one, heights)]
    if not white:
        return 0.0
    read = sum(len(one.residual) for one, _ in white)
    return float(TRIED[likeliest(np.array([heights.T for _, heights in white]), read)])


def _large(share: np.ndarray) -> bool:
    return bool(np.mean(share > 0.5 * share.max()) >= FEW)


def _white(one: Left, heights: np.ndarray) -> bool:
    """Whether scores are white at the growth that is the likeliest for them."""
    growth = float(TRIED[int(np.argmax(heights.max(axis=0)))])
    even = one.score / np.sqrt(_variance(one.share, growth))
    return noise_law(even, np.ones(len(even), dtype=bool)).time == 1.0


def _variance(share: np.ndarray, growth: float | np.ndarray) -> np.ndarray:
    return 1.0 + (growth * share) ** 2


def _heights(one: Left, laws: Sequence[Law]) -> np.ndarray:
    """Log-likelihood at each law and each of TRIED (laws, tried), the noise's level at its best."""
    order = np.argsort(one.share, kind="stable")
    total = np.zeros((len(laws), len(TRIED), len(EVEN)))
    for rows in np.array_split(order, CLASSES):
        usual = np.sqrt(np.mean(one.share[rows] ** 2, keepdims=True))
        louder = 0.5 * np.log2(_variance(usual, TRIED))
        counted = Counted.of(one.residual[rows], one.step)
        some = counted.many > 0
        counted = counted._replace(size=counted.size[some], many=counted.many[some])
        for number, law in enumerate(laws):
            height = CubicSpline(LOGS, counted.heights(law, scales=2.0**LOGS))
            total[number] += height(EVEN + louder[:, None])
    return total.max(axis=2)
