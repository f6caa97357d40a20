"""Quantiles of a mixture of Gaussians at every time, draw after draw, in memory that stays put."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr, ndtri

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)

GRID = np.sinh(np.linspace(-3.2, 3.2, 49)) / np.sinh(3.2) * 9.0
"""Places at which the distribution is kept, in sds of the first batch about its mean: 0.1 apart
in the middle. Between them it is interpolated; a quantile is within 0.01 sd (tests hold it) where
the draws lie no further apart than three times their own width."""

HALVINGS = 30
"""Of the stretch in which a quantile of several mixtures lies: to 1e-9 of it."""


@dataclass(eq=False)
class Mixture:
    """A running mixture, one for each time.

    - `centre`, `width` (times,): of the grid, from the first batch. - `below` (times, grid):
      weighted count of draws below each place. - `weight`: of all draws so far.
    """

    centre: np.ndarray = field(default_factory=lambda: np.zeros(0))
    width: np.ndarray = field(default_factory=lambda: np.zeros(0))
    below: np.ndarray = field(default_factory=lambda: np.zeros(0))
    weight: float = 0.0

    def add(self, mean: np.ndarray, variance: np.ndarray, weight: float = 1.0) -> None:
        """Take in draws: mean and variance (draws, times), each draw of the same weight."""
        if self.weight == 0.0:
            self.centre = mean.mean(axis=0)
            self.width = np.sqrt(variance.mean(axis=0) + mean.var(axis=0) + 1e-300)
            self.below = np.zeros((mean.shape[1], GRID.size), dtype=np.float32)
        place = self.centre[:, None] + self.width[:, None] * GRID
        for one, spread in zip(mean, np.sqrt(np.maximum(variance, 0.0)), strict=True):
            least = np.maximum(spread, 1e-6 * self.width)
            self.below += weight * ndtr((place - one[:, None]) / least[:, None]).astype(np.float32)
        self.weight += weight * len(mean)

    def quantiles(self, levels: tuple[float, ...] = LEVELS) -> np.ndarray:
        """Return quantiles (levels, times)."""
        share = self._shares()
        out = np.empty((len(levels), len(self.centre)))
        rows = np.arange(len(self.centre))
        for i, level in enumerate(levels):
            right = np.clip((share < level).sum(axis=1), 1, GRID.size - 1)
            # Between two places the normal score of the share is closer to a line than the share.
            low, high = (_score(share[rows, i]) for i in (right - 1, right))
            part = np.clip((ndtri(level) - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)
            at = GRID[right - 1] + part * (GRID[right] - GRID[right - 1])
            out[i] = self.centre + self.width * at
        return out

    def share(self, values: np.ndarray) -> np.ndarray:
        """Return the share of the mixture below `values` (times,), interpolated as in quantiles."""
        place = (values - self.centre) / self.width
        right = np.clip(np.searchsorted(GRID, place), 1, GRID.size - 1)
        rows, share = np.arange(len(self.centre)), self._shares()
        low, high = (_score(share[rows, i]) for i in (right - 1, right))
        part = np.clip((place - GRID[right - 1]) / (GRID[right] - GRID[right - 1]), 0.0, 1.0)
        return ndtr(low + part * (high - low))

    def _shares(self) -> np.ndarray:
        return np.maximum.accumulate(self.below / self.weight, axis=1)


def _score(share: np.ndarray) -> np.ndarray:
    # In 32 bits the upper end would be 1, and its score infinite.
    return ndtri(np.clip(share.astype(float), 1e-9, 1 - 1e-9))


def quantiles(mixtures: Sequence[Mixture], levels: tuple[float, ...] = LEVELS) -> np.ndarray:
    """Return quantiles (levels, times) of several mixtures together, each with its weight.

    Each keeps a grid of its own, so they may lie as far apart as they like; between the least and
    the greatest of their own quantiles the place is found by halving.
    """
    each = np.stack([one.quantiles(levels) for one in mixtures])
    if len(mixtures) == 1:
        return each[0]
    low, high = each.min(axis=0), each.max(axis=0)
    weight = np.array([one.weight for one in mixtures]) / sum(one.weight for one in mixtures)
    for i, level in enumerate(levels):
        for _ in range(HALVINGS):
            middle = 0.5 * (low[i] + high[i])
            shares = [w * one.share(middle) for w, one in zip(weight, mixtures, strict=True)]
            under = np.sum(shares, axis=0) < level
            low[i], high[i] = np.where(under, middle, low[i]), np.where(under, high[i], middle)
    return 0.5 * (low + high)


@dataclass(eq=False)
class Moments:
    """Running weighted mean and variance of series, (times,)."""

    weight: float = 0.0
    mean: np.ndarray = field(default_factory=lambda: np.zeros(0))
    squares: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def add(self, values: np.ndarray, weight: float = 1.0) -> None:
        """Take in rows of (draws, times)."""
        for row in values:
            if self.weight == 0.0:
                self.mean, self.squares = np.zeros(row.shape), np.zeros(row.shape)
            self.weight += weight
            off = row - self.mean
            self.mean = self.mean + off * weight / self.weight
            self.squares = self.squares + weight * off * (row - self.mean)

    @property
    def variance(self) -> np.ndarray:
        """Variance so far."""
        return self.squares / max(self.weight, 1e-300)
