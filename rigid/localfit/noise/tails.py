"""Noise with heavier tails than a Gaussian's: single samples far off count less.

Under Student's law with nu degrees of freedom a residual of r scales has the score of a Gaussian's
times (nu + 1) / (nu + r^2): the further off, the less it counts (Lange, Little and Taylor 1989,
Journal of the American Statistical Association 84, 881-896). Taken for Gaussian, a few such samples
in one place look like something that is missing there. A converter whose step is some noise wide
makes it worse: samples in the middle of a step tell hardly anything, and one that is far beyond its
edge has a score many times theirs.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import log_ndtr, stdtr
from scipy.stats import norm, poisson
from scipy.stats import t as student

from rigid.likelihood.correlation import LEAST_SAMPLES
from rigid.likelihood.set_aside import Readings
from rigid.localfit.samples import Layout

TRIED = (2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0)
"""Degrees of freedom that are tried."""
SCALES = np.geomspace(0.25, 2.0, 49)
"""Scales that are tried, in sds of the fit's noise, the unit of all residuals here."""
FINE, FAR = 0.05, 40.0
"""Width of the classes in which sizes of residuals are counted, and the greatest size."""
FINEST = 0.1
"""Least step of a converter: what has a finer one or none has a density that is as even."""
RARE, LAGS = 0.01, 5
"""Probability of a reading as far off from which it counts as large; neighbours it is held to."""
REACH = 6.0
"""Noise sds within which all codes are counted that a reading may have."""
CLUSTERED = 1e-3
"""Probability of as many large neighbours by chance below which they come together: what is off for
several samples is no tail."""
MOST = 0.98
"""Greatest share of itself that a sample may have in what explains it: what is left is rounding."""
ROUNDS = 3
"""Of weights by the noise level that they lead to."""


class Law(NamedTuple):
    """Noise of unit scale: log of the probability of more than x, and of the density at x."""

    above: Callable[[np.ndarray], np.ndarray]
    density: Callable[[np.ndarray], np.ndarray]

    def log(self, size: np.ndarray, half: float, scale: np.ndarray | float) -> np.ndarray:
        """Log-probability of a code that is `size` (m,) off, of `scale` (k, 1), (k, m).

        - `half`: of the converter's step.
        """
        near = self.above((size - half) / scale)
        mass = -np.expm1(self.above((size + half) / scale) - near)
        return near + np.log(np.maximum(mass, 1e-300))

    def score(self, size: np.ndarray, half: float, scale: float) -> np.ndarray:
        """Slope of the log-probability by the expected reading, (m,)."""
        mass = self.log(size, half, scale)
        low, high = (np.exp(self.density((size + a) / scale) - mass) for a in (-half, half))
        return (low - high) / scale


GAUSS = Law(lambda x: log_ndtr(-x), norm.logpdf)


def student_law(dof: float) -> Law:
    """Student's law."""
    return Law(lambda x: np.log(stdtr(dof, -x)), lambda x: student.logpdf(x, dof))


class Counted(NamedTuple):
    """Residuals of one channel by their size.

    - `half`: of the converter's step. - `size` (m,): centres of classes. - `many` (m,): residuals
      in each. - `at` (n,): class of each residual.
    """

    half: float
    size: np.ndarray
    many: np.ndarray
    at: np.ndarray

    @classmethod
    def of(cls, residual: np.ndarray, step: float) -> "Counted":
        """Count residuals (n,) of a channel whose converter has a step."""
        at = (np.minimum(np.abs(residual), FAR) / FINE).astype(int)
        many = np.bincount(at)
        return cls(0.5 * step, FINE * (np.arange(len(many)) + 0.5), many, at)

    def heights(
        self, law: Law, weight: np.ndarray | float = 1.0, scales: np.ndarray = SCALES
    ) -> np.ndarray:
        """Log-likelihood at each of some scales, classes weighed (m,)."""
        return law.log(self.size, self.half, scales[:, None]) @ (self.many * weight)

    def known(self, law: Law, scale: float, weight: np.ndarray) -> float:
        """Information of all residuals on the expected reading, classes weighed (m,)."""
        before, after = (
            law.score(self.size + a, self.half, scale) for a in (-0.5 * FINE, 0.5 * FINE)
        )
        return float((after - before) @ (self.many * weight)) / FINE


def weights(channels: Sequence[Counted], dof: float) -> list[np.ndarray]:
    """Weight of each residual of some channels in the likelihood of a Gaussian, (n,) each.

    With these weights, and the noise that is fitted with them, residuals have the scores of
    Student's law, but in the middle of a wide step, and all together the information that is in
    these scores.
    """
    law = student_law(dof)
    level = scale = float(SCALES[np.argmax(sum(one.heights(law) for one in channels))])
    by_size: list[np.ndarray] = []
    for _ in range(ROUNDS):
        by_size = [_ratio(one, law, scale, level, dof) for one in channels]
        each = zip(channels, by_size, strict=True)
        level = float(SCALES[np.argmax(sum(one.heights(GAUSS, w) for one, w in each))])
    scored = known = 0.0
    for one, weight in zip(channels, by_size, strict=True):
        scored += float(one.many @ (weight * GAUSS.score(one.size, one.half, level)) ** 2)
        known += one.known(GAUSS, level, weight)
    share = scored / known if known > 0.0 else 1.0
    return [share * w[one.at] for one, w in zip(channels, by_size, strict=True)]


def _ratio(one: Counted, law: Law, scale: float, level: float, dof: float) -> np.ndarray:
    """Score of Student's law of a scale over a Gaussian's of a level, by size (m,)."""
    mine = GAUSS.score(one.size, one.half, level)
    theirs = law.score(one.size, one.half, scale)
    # in the middle of a wide step a Gaussian's score is as good as nothing
    return np.minimum(theirs / np.maximum(mine, 1e-300), (dof + 1.0) / dof)


def tails(tracks: Mapping[str, Sequence[Counted]]) -> float | None:
    """Degrees of freedom of the noise of some records' channels; None where it is Gaussian.

    Tails are those of a quantity's sensors: with any one record left out they are there, too.
    """
    laws = [GAUSS, *map(student_law, TRIED)]
    heights = np.array(
        [[sum(one.heights(law) for one in some) for law in laws] for some in tracks.values()]
    )
    read = sum(len(one.at) for some in tracks.values() for one in some)
    chosen = likeliest(heights, read)
    return TRIED[chosen - 1] if chosen else None


def likeliest(heights: np.ndarray, read: int) -> int:
    """Number of the law of noise that records ask for; 0, the first, unless all of them do.

    - `heights` (records, laws, settings): log-likelihoods; of the settings each law has its best.
    - `read`: samples in all.

    With any one record left out the law has to gain more than the first by the price of a number.
    """
    total = heights.sum(axis=0)
    without = total - (heights if len(heights) > 1 else 0.0 * heights)
    best = without.max(axis=2)  # by record left out and law
    chosen = 1 + int(np.argmax(total[1:].max(axis=1)))
    gains = best[:, chosen] - best[:, 0]
    return chosen if gains.min() > 0.5 * np.log(read) else 0


def by_tails(
    layout: Layout,
    readings: Readings,
    residual: Float[np.ndarray, " n"],
    good: Bool[np.ndarray, " n"],
    leverage: Callable[[np.ndarray], np.ndarray],
) -> tuple[Float[np.ndarray, " n"], dict[str, float]]:
    """Weight of each sample for how far off it is (n,), 1 where the noise is a Gaussian's.

    The second of what is returned are degrees of freedom by quantity, where it is not.

    - `readings`: the samples of the layout. - `residual` (n,): what nothing explains of the fit's.
    - `good` (n,): what counts. - `leverage`: share of itself in what explains samples (rows,).

    How far off a sample is the others tell: one that is explained by what it alone asks for is as
    far off as before. Only channels whose large samples do not come together are asked whether
    there are tails: what is off for several samples in a row is something that is missing.
    """
    out, found = np.ones(len(residual)), {}
    channels = unexplained(layout, readings, residual, good)
    for quantity in dict.fromkeys(one.quantity for one in channels):
        mine = [one for one in channels if one.quantity == quantity]
        asked: dict[str, list[Counted]] = {}
        for one in mine:
            if not _clustered(one.residual, one.step):
                asked.setdefault(one.track, []).append(Counted.of(one.residual, one.step))
        if asked and (dof := tails(asked)) is not None:
            found[quantity] = dof
            others = [1.0 - np.minimum(leverage(one.rows), MOST) for one in mine]
            told = [
                Counted.of(one.residual / share, one.step)
                for one, share in zip(mine, others, strict=True)
            ]
            for one, weight in zip(mine, weights(told, dof), strict=True):
                out[one.rows] = weight
    return out, found


class Unexplained(NamedTuple):
    """What nothing explains of a channel: its rows (m,), residuals (m,) and step, in noise."""

    track: str
    quantity: str
    rows: np.ndarray
    residual: np.ndarray
    step: float


def unexplained(
    layout: Layout, readings: Readings, residual: np.ndarray, good: np.ndarray
) -> list[Unexplained]:
    """All channels of which enough samples count.

    - `readings`, `residual` (n,), `good` (n,): as of `by_tails`.
    """
    noise = np.sqrt(readings.sd**2 - readings.step**2 / 12.0)
    found = []
    for number, channel in enumerate(layout.channels):
        rows = np.flatnonzero((layout.channel == number) & good)
        if len(rows) >= LEAST_SAMPLES:
            unit = float(noise[rows[0]])
            step = max(float(readings.step[rows[0]]) / unit, FINEST)
            found.append(
                Unexplained(channel.track, channel.quantity, rows, residual[rows] / unit, step)
            )
    return found


def _clustered(residual: np.ndarray, step: float) -> bool:
    """Whether large residuals of a channel (n,) come together, more than by chance.

    - `step`: of the converter. How far off a code is large depends on where between two codes the
      reading is; so does how often that happens.
    """
    half = 0.5 * step
    reach = int(np.ceil(REACH / step)) + 1
    code = np.rint(residual / step)
    codes = np.arange(-reach, reach + 1)
    off = (residual - step * code)[:, None] + step * codes
    chance = np.exp(GAUSS.log(off.ravel(), half, np.ones((1, 1)))).reshape(off.shape)
    order = np.argsort(-np.abs(off), axis=1)
    tail = np.empty_like(chance)
    np.put_along_axis(tail, order, np.cumsum(np.take_along_axis(chance, order, 1), axis=1), 1)
    rate = np.where(tail < RARE, chance, 0.0).sum(axis=1)
    within = np.abs(code) <= reach
    mine = np.clip(code, -reach, reach).astype(int) + reach
    large = ~within | (tail[np.arange(len(mine)), mine] < RARE)
    more = np.count_nonzero(large) / max(rate.sum(), 1e-300)
    lags = range(1, LAGS + 1)
    pairs = sum(np.count_nonzero(large[k:] & large[:-k]) for k in lags)
    usual = more**2 * sum(float(rate[k:] @ rate[:-k]) for k in lags)
    return bool(poisson.sf(pairs - 1, usual) < CLUSTERED)
