"""Simulated campaigns of a fit, in which nothing is missing: what fitting them leaves.

Noise is as correlated as here and read by the same converters. How correlated that is, records tell
within limits: each campaign has a law of its own of those that they allow, the same in all records
of a sensor whose noise may be one.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from rigid.likelihood.common_noise import Likely
from rigid.likelihood.noise_spectrum import NoiseLaw, scaled, swings
from rigid.localfit.local import LocalFit
from rigid.localfit.noise.codes import Codes
from rigid.localfit.noise.leftover import (
    Explaining,
    Left,
    Shared,
    Told,
    Traces,
    coloured,
    common,
    noise_told,
)
from rigid.localfit.samples import ChannelKey

DRAWS = 1000
"""Simulated campaigns."""


class Drawn(NamedTuple):
    """Law of the noise of a channel in some campaigns, by `columns` (some,)."""

    law: NoiseLaw
    columns: np.ndarray


class Campaigns(NamedTuple):
    """Simulated campaigns of a fitted model.

    Noise is drawn anew where it is asked for, channel by channel: all at once takes gigabytes.

    - `noise`: of each channel, before its converter and in its sds. - `coefficients` (size, DRAWS):
      what fitting them takes.
    """

    local: LocalFit
    noise: tuple[tuple[Drawn, ...], ...]
    codes: Codes
    seed: int
    coefficients: np.ndarray

    @classmethod
    def of(cls, local: LocalFit, traces: Traces, seed: int) -> "Campaigns":
        """Draw campaigns, and fit them to first order.

        - `traces`: of all that may be missing, so that none of it is taken for noise.
        """
        layout, codes = local.layout, Codes.of(local)
        explaining = Explaining.by(local, traces.columns)
        told = noise_told(local, explaining, traces, layout.weight > 0.0, codes)
        sensors = {
            key: number for number, key in enumerate(dict.fromkeys(map(_key, layout.channels)))
        }
        noise = tuple(
            tuple(drawn(one, bool(step), np.random.default_rng([seed, 9, sensors[_key(channel)]])))
            for channel, one, step in zip(layout.channels, told, codes.step, strict=True)
        )
        # Where the truth lies in the prior is drawn, too: the fit is pulled off it by its prior.
        rng = np.random.default_rng([seed, 8])
        gradient = -rng.standard_normal((len(local.w), DRAWS))
        campaigns = cls(local, noise, codes, seed, gradient)
        for number, rows in enumerate(codes.rows):
            gradient += local.design[rows].T @ campaigns.scores(number)
        return campaigns._replace(coefficients=cho_solve(cho_factor(local.information), gradient))

    def scores(self, number: int) -> np.ndarray:
        """Scores of a channel's noise (samples of it, DRAWS)."""
        rng = np.random.default_rng([self.seed, 8, number])
        noise = np.empty((len(self.codes.rows[number]), DRAWS))
        for law, columns in self.noise[number]:
            fresh = rng.standard_normal((law.settling + len(noise), len(columns)))
            noise[:, columns] = coloured(law, fresh)
        return self.codes.of_noise(number, noise)

    def left(self, number: int, rows: np.ndarray) -> np.ndarray:
        """What fitting leaves of it in some rows of the channel (rows, DRAWS)."""
        taken = self.local.design[rows] @ self.coefficients
        noise = self.scores(number)[np.searchsorted(self.codes.rows[number], rows)]
        return noise - self.local.terms.curvature[rows, None] * taken


def _key(channel: ChannelKey) -> tuple[str, float]:
    return channel.sensor, channel.interval


def drawn(told: Told, rounded: bool, rng: np.random.Generator) -> Iterator[Drawn]:
    """Draw the law that a channel's noise has in each campaign.

    - `told`: of its noise. - `rounded`: whether the variance is 1. - `rng`: the same for all
      records of a sensor, so that these share it.

    Noise that swings has the likeliest law alone.
    """
    place, other = rng.random((2, DRAWS))
    mine = told.own if told.mine is None else told.mine
    size, own_size = (None, None) if rounded else (mine.level, told.own.level)
    if not rounded and _swings(told.own):
        yield Drawn(told.own.law, np.arange(DRAWS))
    elif not told.others:
        yield from _groups(common([mine], 1.0).likely, place, np.arange(DRAWS), size)
    else:
        shared = Shared.of(mine, told.others, 1.0)
        yield from _groups(shared.alike.likely, place, np.flatnonzero(other < shared.like), size)
        apart = np.flatnonzero(other >= shared.like)
        own, others = common([told.own], 1.0).likely, shared.apart.likely
        slower = own.time[own.at(place)] > others.time[others.at(place)]
        yield from _groups(own, place, apart[slower[apart]], own_size)
        yield from _groups(others, place, apart[~slower[apart]], size)


def _swings(own: Left) -> bool:
    """Whether noise is far likelier to swing than to fade."""
    return own.law.coefficients.size > 1 and swings(own.found, float(np.log(own.read)))


def _groups(
    likely: Likely, place: np.ndarray, columns: np.ndarray, level: float | None
) -> Iterator[Drawn]:
    """Group campaigns, by `columns`, by their law; `level`: of the series, None: variance 1."""
    numbers = likely.at(place[columns])
    for number in np.unique(numbers).tolist():
        size = 1.0 / likely.size[number].sum() if level is None else level
        yield Drawn(scaled(likely.law(number), size), columns[numbers == number])
