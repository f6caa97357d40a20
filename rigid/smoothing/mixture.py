"""Quantiles of a mixture of Gaussians at every time, draw after draw, in memory that stays put."""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr, ndtri

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)

GRID = np.sinh(np.linspace(-3.2, 3.2, 49)) / np.sinh(3.2) * 9.0
"""Places at which the distribution is kept, in sds of the first batch about its mean: 0.1 apart
in the middle. Between them it is interpolated; a quantile is within 0.01 sd (tests hold it) where
the draws lie no further apart than three times their own width."""


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
        share = np.maximum.accumulate(self.below / self.weight, axis=1)
        out = np.empty((len(levels), len(self.centre)))
        rows = np.arange(len(self.centre))
        for i, level in enumerate(levels):
            right = np.clip((share < level).sum(axis=1), 1, GRID.size - 1)
            # Between two places the normal score of the share is closer to a line than the share.
            low, high = (ndtri(np.clip(share[rows, i], 1e-9, 1 - 1e-9)) for i in (right - 1, right))
            part = np.clip((ndtri(level) - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)
            at = GRID[right - 1] + part * (GRID[right] - GRID[right - 1])
            out[i] = self.centre + self.width * at
        return out


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
